#pragma once
/// The estimator: radiance of one camera ray, by one random path.
///
///   Lo(x,wo) = Le(x,wo) + ∫ fr(x,wi,wo) Li(x,wi) (n·wi) dwi                              (Kajiya 1986)
///   estimate = Σ_k  T_k · [ Le of what the ray hits  +  f·cos·Le/pdf of one sampled light ],   T_k+1 = T_k · f·cos/pdf
///
/// The split. A vertex is *specular* when its BSDF is a delta function. `direct` = what the camera sees emit, through
/// any number of specular vertices, plus the light that reaches the first non-specular vertex straight from an emitter, by
/// whichever technique it is found. `indirect` = everything else. Both parts of one sample walk the same path, because
/// each decision has its own dimension of the sampler; so direct(s) + indirect(s) is what a plain path tracer finds in
/// sample s, and the MIS weights never count an emitter in both.
///
/// Units: radiance, linear RGB. A path with n scatterings (reflections or refractions) adds to bounce n; emission seen
/// by the camera is bounce 0; settings.max_bounces limits n.
/// Requires: ray.direction of length one.
/// Thread safety: pure, but for `rays` and `probe`, which are the caller's.
/// See:   Kajiya 1986; Veach 1997, chapters 8-10.
/// Test:  tests/integrator/test_path_estimator.cpp (furnace, oracle, z-test)   Lesson: lessons/01-rendering-equation

#include <array>
#include <cstdint>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/integrator/direct_light.hpp"
#include "pathscope/integrator/russian_roulette.hpp"
#include "pathscope/integrator/settings.hpp"
#include "pathscope/integrator/vertex.hpp"
#include "pathscope/math/ray.hpp"
#include "pathscope/sampling/sampler.hpp"
#include "pathscope/scene/scene.hpp"

namespace pathscope {

enum class LightPart { direct, indirect };

constexpr std::array k_light_part_names{EnumName<LightPart>{LightPart::direct, "direct"},
                                        EnumName<LightPart>{LightPart::indirect, "indirect"}};
constexpr const auto& enum_table(LightPart) { return k_light_part_names; }

/// Sees each contribution as it is added; the default sees nothing and costs nothing.
struct NullPathProbe {
    void contribution(int /*bounce*/, Rgb /*radiance*/) {}
};

/// A path's specular start is free of roulette for this many bounces: mirrors and glass in front of the camera would
/// otherwise make noise where the textbook has none. Beyond it, two facing mirrors must end as well.
inline constexpr int k_free_specular_bounces = 16;

/// ray: the camera ray. rays: counts all that are traced.
template <LightPart part, class Probe = NullPathProbe>
[[nodiscard]] Rgb estimate_radiance(const Scene& scene, const TransportSettings& settings, Ray ray,
                                    const PixelSampler& sampler, std::uint64_t& rays, Probe&& probe = {}) {
    std::optional<SceneHit> hit = intersect(scene, ray);
    ++rays;
    Rgb radiance;
    Rgb throughput{1, 1, 1};
    PathStrength strength;
    PathOrigin origin;  // What the ray leaves: the camera at first, later a vertex.
    int diffuse_vertices = 0;

    const auto add = [&](int bounce, Rgb contribution) {
        if (is_zero(contribution)) return;
        radiance += contribution;
        probe.contribution(bounce, contribution);
    };

    for (int bounce = 0;; ++bounce) {
        // Light that the ray runs into. It is direct as long as the ray comes from the camera, from a specular start,
        // or from the first non-specular vertex; and then MIS shares it with the light sample taken there.
        const bool sees_direct = diffuse_vertices == 0 || (diffuse_vertices == 1 && origin.diffuse);
        if (sees_direct == (part == LightPart::direct))
            add(bounce, throughput * emission_towards(scene, settings, origin, ray, hit));
        if (part == LightPart::direct && diffuse_vertices > 0) break;
        if (!hit || (settings.max_bounces > 0 && bounce == settings.max_bounces)) break;

        const BounceSample random(sampler, bounce);
        const Vertex vertex(scene, *hit, -ray.direction);
        if (!vertex.specular) ++diffuse_vertices;

        // Light that reaches the vertex straight from an emitter.
        const bool is_first_diffuse = !vertex.specular && diffuse_vertices == 1;
        if (!vertex.specular && is_first_diffuse == (part == LightPart::direct))
            add(bounce + 1, throughput * sample_direct_light(scene, settings, vertex, random, rays));

        // The next direction, and whether it is worth a ray. The direct part ends with that ray, so it plays no roulette,
        // and does without it where the light sample counts alone.
        const std::optional<NextDirection> next = sample_next_direction(settings, vertex, random);
        if (!next) break;
        if (part == LightPart::direct && is_first_diffuse && !sees_emitters(settings, next->delta)) break;
        throughput *= next->weight;
        if (is_zero(throughput)) break;
        if (!is_finite(throughput))
            return throughput;  // Not a radiance: the caller drops and counts the sample.
        strength.now = max_component(throughput);
        if (is_first_diffuse) strength.first = strength.now;
        const bool plays_roulette =
            diffuse_vertices > 0 ? part == LightPart::indirect : bounce >= k_free_specular_bounces;
        if (plays_roulette) {
            const std::optional<float> weight = roulette_weight(
                strength, bounce, [&] { return random.roulette(); }, settings.roulette);
            if (!weight) break;
            throughput *= *weight;
        }
        origin = make_origin(vertex, *next);
        ray = spawn_ray(vertex.point, next->direction);
        intersect(scene, ray, hit);
        ++rays;
    }
    return radiance;
}

}  // namespace pathscope
