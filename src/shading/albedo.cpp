#include "pathscope/shading/albedo.hpp"

#include <cmath>
#include <numbers>

#include "pathscope/core/check.hpp"
#include "pathscope/math/frame.hpp"
#include "pathscope/sampling/unit_circle.hpp"

namespace pathscope {

Rgb directional_albedo(const Bsdf& bsdf, Vec3 outgoing, int steps) {
    CHECK(outgoing.z > 0 && steps > 0, outgoing.z, steps);
    const Frame frame = Frame::around({-outgoing.x, -outgoing.y, outgoing.z});
    double sum[3] = {};
    for (int i = 0; i < steps; ++i) {
        // theta = pi t^3: near the peak a step is a millionth of a turn, so that every lobe gets many of them.
        const double t = (i + 0.5) / steps;
        const double theta = std::numbers::pi * t * t * t;
        const double step_theta = 3 * std::numbers::pi * t * t / steps;
        const double solid_angle = std::sin(theta) * step_theta * 2 * std::numbers::pi / steps;
        for (int j = 0; j < steps; ++j) {
            const Vec2 ring = unit_circle((float(j) + 0.5f) / float(steps)) * float(std::sin(theta));
            const Vec3 incoming = normalize(frame.to_world({ring.x, ring.y, float(std::cos(theta))}));
            if (incoming.z <= 0) continue;
            const Rgb value = eval_bsdf(bsdf, outgoing, incoming);
            for (int c = 0; c < 3; ++c) sum[c] += value[c] * incoming.z * solid_angle;
        }
    }
    return {float(sum[0]), float(sum[1]), float(sum[2])};
}

}  // namespace pathscope
