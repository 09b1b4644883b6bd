#pragma once
/// Light straight from an emitter, found in two ways that share one integral.
///
///   ∫ f Le V cos dw  ≈  w_l f Le V cos / p_l   by a sampled light (sample_direct_light), and
///                       w_b f Le cos / p_b     by the direction the path takes anyway (emission_towards)
///
/// with w_l + w_b = 1 for each direction (sampling/mis.hpp); p_l counts all n light samples: p_l = n P(light) pdf. With MIS
/// off the light sample counts alone, and an emitter that the path runs into counts only after the camera or a delta lobe,
/// which no light sample can reach.
/// Why both: a small light is found by sampling lights, a mirror-like surface finds a large one by itself (Veach's
/// plates).
/// Units: radiance. The path's throughput is the caller's.
/// See:  Veach & Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering".
/// Thread safety: pure; `rays` is the caller's.
/// Test: tests/integrator/test_direct_light.cpp (form factor)    Lesson: lessons/04-light-sampling

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "pathscope/integrator/vertex.hpp"

namespace pathscope {

/// How many light samples a vertex takes.
[[nodiscard]] inline int light_sample_count(const Scene& scene, const TransportSettings& settings) {
    if (settings.light_samples != k_auto_light_samples) return settings.light_samples;
    return std::min(2, int(scene.lights.lights.size()));
}

/// What a light sample brings if its ray meets nothing: f Le / p_l, with its MIS weight, and divided by the number of samples.
struct UnshadowedLight {
    Ray ray;
    Rgb radiance;
};

/// Number i of the light samples at a vertex; nothing if no light can come from there. They are a lattice of `count` points, turned
/// by one random shift: so two samples of sun and sky, or of two lamps, are one of each, and of more lights they are at least
/// spread. Requires: !vertex.specular.
[[nodiscard]] inline std::optional<UnshadowedLight> unshadowed_light(const Scene& scene,
                                                                     const TransportSettings& settings,
                                                                     const Vertex& vertex,
                                                                     const BounceSample& random, int i,
                                                                     int count) {
    const float shift = float(i) / float(count);
    const auto turned = [shift](float u) { return u + shift - std::floor(u + shift); };
    const Vec2 u = random.light_point();
    const std::optional<LightSample> light = sample_light(scene, settings.light, vertex.light_reference(),
                                                          turned(random.light_pick()), {turned(u.x), u.y});
    if (!light || !is_consistent(vertex.side, light->direction)) return std::nullopt;

    const Vec3 incoming = vertex.side.frame.to_local(light->direction);
    const BsdfValue bsdf = eval_bsdf_and_pdf(settings.hemisphere, vertex.seen, incoming);
    if (is_zero(bsdf.value)) return std::nullopt;

    const float density = float(count) * light->pdf_solid_angle;
    const float weight = light->delta ? 1.0f : mis_weight(settings.mis, density, bsdf.pdf_solid_angle);
    return UnshadowedLight{shadow_ray(vertex.point, *light),
                           bsdf.value * light->radiance * (std::abs(incoming.z) * weight / density)};
}

/// Light at the vertex. Requires: !vertex.specular.
[[nodiscard]] inline Rgb sample_direct_light(const Scene& scene, const TransportSettings& settings,
                                             const Vertex& vertex, const BounceSample& random,
                                             std::uint64_t& rays) {
    const int count = light_sample_count(scene, settings);
    Rgb sum;
    for (int i = 0; i < count; ++i) {
        const auto light = unshadowed_light(scene, settings, vertex, random, i, count);
        if (!light) continue;
        ++rays;
        if (!occluded(scene, light->ray)) sum += light->radiance;
    }
    return sum;
}

/// Whether emitters count that a ray runs into. delta: its direction has no density.
[[nodiscard]] inline bool sees_emitters(const TransportSettings& settings, bool delta) {
    return delta || uses_both_techniques(settings.mis);
}

/// What the ray runs into sends back along it, with the MIS weight of having found it this way.
[[nodiscard]] inline Rgb emission_towards(const Scene& scene, const TransportSettings& settings,
                                          const PathOrigin& origin, const Ray& ray,
                                          const std::optional<SceneHit>& hit) {
    if (hit && hit->light == k_no_light) return {};
    if (!sees_emitters(settings, origin.delta)) return {};

    const Rgb emitted =
        hit ? emitted_radiance(scene, *hit, -ray.direction) : environment_radiance(scene, ray.direction);
    if (origin.delta || is_zero(emitted)) return emitted;
    const float light_pdf =
        hit ? sample_light_pdf(scene, settings.light, origin.reference, *hit)
            : sample_environment_pdf(scene, settings.light, origin.reference, ray.direction);
    const auto count = float(light_sample_count(scene, settings));
    return emitted * mis_weight(settings.mis, origin.pdf_solid_angle, count * light_pdf);
}

}  // namespace pathscope
