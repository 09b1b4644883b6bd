#include "pathscope/integrator/direct_light.hpp"

#include <cmath>

#include "integrator/estimator_scenes.hpp"
#include "statistics.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// Form factor from a small patch to a parallel rectangle of sides a and b at height h, one corner above the patch
/// (Lambert; e.g. Howell's catalogue, B-4).
double corner_form_factor(double a, double b, double h) {
    const double x = a / h, y = b / h;
    const double rx = std::sqrt(1 + x * x), ry = std::sqrt(1 + y * y);
    return (x / rx * std::atan(y / rx) + y / ry * std::atan(x / ry)) / (2 * std::acos(-1.0));
}

/// Direct light of a white floor seen from above, below a quad light centred over it.
Moments floor_radiance(const TransportSettings& settings, float half_u, float half_v, float height,
                       Rgb radiance) {
    SceneParts parts = empty_parts();
    add_rectangle(parts, {-50, 0, -50}, {0, 0, 100}, {100, 0, 0}, add_material(parts, lambert({1, 1, 1})));
    const QuadLightSpec light{{-half_u, height, -half_v}, {2 * half_u, 0, 0}, {0, 0, 2 * half_v}, radiance};
    const Scene scene = small_scene(std::move(parts), {light});
    Moments moments;
    for (std::uint32_t i = 0; i < (k_sanitized ? 20'000u : 200'000u); ++i) {
        const PixelSampler sampler(SamplerKind::independent, 3, 0, 0, i);
        std::uint64_t rays = 0;
        const Ray ray{{0, height / 2, 0}, {0, -1, 0}};  // From below the light, which hides nothing.
        moments.add(estimate_radiance<LightPart::direct>(scene, settings, ray, sampler, rays).x);
    }
    return moments;
}

}  // namespace

TEST_CASE("the irradiance below a rectangular light is Lambert's form factor times pi L") {
    for (const Setting setting : {Setting::best, Setting::textbook})
        for (const auto& [u, v, h] : {std::array{1.0f, 1.0f, 1.0f}, {3.0f, 0.5f, 0.7f}, {0.1f, 0.2f, 4.0f}}) {
            CAPTURE(name_of(setting));
            CAPTURE(h);
            // The quad shines down: edge_u x edge_v must point to -y, so the edges are swapped by their order.
            const Moments moments = floor_radiance(make_settings(setting), u, v, h, {2, 2, 2});
            // Radiance of a white Lambert floor = E / pi = L F.
            const double answer = 2 * 4 * corner_form_factor(u, v, h);
            CHECK(std::abs(moments.mean() - answer) < 4 * moments.standard_error() + 1e-6 * answer);
        }
}

TEST_CASE(
    "of one light a vertex takes one sample, of two one of each, of more two; or as many as it is told") {
    std::vector<LightSpec> lights;
    TransportSettings settings = make_settings(Setting::best);
    for (const int expected : {1, 2, 2, 2}) {
        lights.push_back(PointLightSpec{{float(lights.size()), 1, 0}, {1, 1, 1}});
        const Scene scene = small_scene(empty_parts(), lights);
        CHECK(light_sample_count(scene, settings) == expected);
        settings.light_samples = 5;
        CHECK(light_sample_count(scene, settings) == 5);
        settings.light_samples = k_auto_light_samples;
    }
}

TEST_CASE("two lights without area that light an open floor leave nothing to chance") {
    SceneParts parts = empty_parts();
    add_rectangle(parts, {-50, 0, -50}, {0, 0, 100}, {100, 0, 0}, add_material(parts, lambert({1, 1, 1})));
    const Scene scene = small_scene(
        std::move(parts), {SunSpec{{0, 1, 0}, {2, 2, 2}, 0}, PointLightSpec{{0, 5, 0}, {75, 75, 75}}});
    for (std::uint32_t i = 0; i < 100; ++i) {
        const PixelSampler sampler(SamplerKind::independent, 3, 0, 0, i);
        std::uint64_t rays = 0;
        const Ray ray{{0, 1, 0}, {0, -1, 0}};
        const Rgb found =
            estimate_radiance<LightPart::direct>(scene, make_settings(Setting::best), ray, sampler, rays);
        CHECK(found.x == doctest::Approx((2 + 75 / 25.0) / std::acos(-1.0)));
    }
}
