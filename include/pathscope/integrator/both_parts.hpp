#pragma once
/// Both parts of one sample by one walk: the path that `direct` and `indirect` share is traced once.
///
///     estimate_both_parts(...)  =  { estimate_radiance<direct>(...), estimate_radiance<indirect>(...) },   bit by bit
///
/// Why: each part alone walks from the camera to the first vertex that is not specular, and takes one ray on from there.
/// Whoever renders both, a client without servers, saves that: a fifth of the rays of a Cornell box.
/// The text to read is path_estimator.hpp; here the same steps keep two accounts. They part at the first roulette, which
/// the direct part does not play: then a ray that the indirect part would not have traced may still be traced for the
/// direct one.
///
/// Units, Requires, Thread safety: as estimate_radiance().
/// Test: tests/integrator/test_both_parts.cpp

#include "pathscope/integrator/path_estimator.hpp"

namespace pathscope {

struct PartsRadiance {
    Rgb direct, indirect;
};

/// rays: counts those that are traced here, once each.
[[nodiscard]] inline PartsRadiance estimate_both_parts(const Scene& scene, const TransportSettings& settings,
                                                       const TracedRay& first, const PixelSampler& sampler,
                                                       std::uint64_t& rays) {
    auto [ray, hit] = first;
    PartsRadiance radiance;
    Rgb throughput{1, 1, 1};         // Of the indirect part, roulette included.
    Rgb direct_throughput{1, 1, 1};  // Until the direct part ends.
    bool indirect_lives = true;
    PathOrigin origin;
    PathStrength strength;
    int diffuse_vertices = 0;

    for (int bounce = 0;; ++bounce) {
        const bool sees_direct = diffuse_vertices == 0 || (diffuse_vertices == 1 && origin.diffuse);
        const Rgb emitted = emission_towards(scene, settings, origin, ray, hit);
        if (!is_zero(emitted)) {
            if (sees_direct)
                radiance.direct += direct_throughput * emitted;
            else
                radiance.indirect += throughput * emitted;
        }
        if (!indirect_lives || !hit || (settings.max_bounces > 0 && bounce == settings.max_bounces)) break;

        const BounceSample random(sampler, bounce);
        const Vertex vertex(scene, *hit, -ray.direction);
        if (!vertex.specular) ++diffuse_vertices;
        const bool is_first_diffuse = !vertex.specular && diffuse_vertices == 1;
        if (!vertex.specular) {
            const Rgb light = throughput * sample_direct_light(scene, settings, vertex, random, rays);
            (is_first_diffuse ? radiance.direct : radiance.indirect) += light;
        }

        const std::optional<NextDirection> next = sample_next_direction(settings, vertex, random);
        if (!next) break;
        throughput *= next->weight;
        if (is_zero(throughput)) break;
        const bool direct_lives =
            diffuse_vertices == 0 || (is_first_diffuse && sees_emitters(settings, next->delta));
        if (!is_finite(throughput)) {  // Not a radiance: the caller drops and counts the sample.
            radiance.indirect = throughput;
            if (direct_lives) radiance.direct = throughput;
            break;
        }
        direct_throughput = throughput;
        strength.now = max_component(throughput);
        if (is_first_diffuse) strength.first = strength.now;
        if (diffuse_vertices > 0 || bounce >= k_free_specular_bounces) {
            const std::optional<float> weight = roulette_weight(
                strength, bounce, [&] { return random.roulette(); }, settings.roulette);
            indirect_lives = weight.has_value();
            // Before the first diffuse vertex both parts play; at it the indirect one alone.
            if (!indirect_lives && !(is_first_diffuse && direct_lives)) break;
            if (weight) throughput *= *weight;
            if (diffuse_vertices == 0) direct_throughput = throughput;
        }
        origin = make_origin(vertex, *next);
        ray = spawn_ray(vertex.point, next->direction);
        intersect(scene, ray, hit);
        ++rays;
    }
    return radiance;
}

}  // namespace pathscope
