#include "pathscope/shading/albedo.hpp"

#include <cmath>
#include <numbers>

#include "pathscope/core/check.hpp"
#include "pathscope/sampling/unit_circle.hpp"

namespace pathscope {

Rgb directional_albedo(const Bsdf& bsdf, Vec3 outgoing, int steps) {
    CHECK(outgoing.z > 0 && steps > 0, outgoing.z, steps);
    double sum[3] = {};
    for (int i = 0; i < steps; ++i) {
        // theta = pi/2 t^3: near the normal a step is a millionth of a turn, so that every lobe gets many.
        const double t = (i + 0.5) / steps;
        const double theta = 0.5 * std::numbers::pi * t * t * t;
        const double half_solid_angle =
            std::sin(theta) * (1.5 * std::numbers::pi * t * t / steps) * (2 * std::numbers::pi / steps);
        for (int j = 0; j < steps; ++j) {
            const Vec2 ring = unit_circle((float(j) + 0.5f) / float(steps)) * float(std::sin(theta));
            const Vec3 half{ring.x, ring.y, float(std::cos(theta))};
            const Vec3 incoming = reflect(outgoing, half);
            const float cos_half = dot(outgoing, half);
            if (cos_half <= 0 || incoming.z <= 0) continue;
            // dwi = 4 (wo . h) dh
            const double measure = 4 * cos_half * half_solid_angle * incoming.z;
            const Rgb value = eval_bsdf(bsdf, outgoing, incoming);
            for (int c = 0; c < 3; ++c) sum[c] += value[c] * measure;
        }
    }
    return {float(sum[0]), float(sum[1]), float(sum[2])};
}

}  // namespace pathscope
