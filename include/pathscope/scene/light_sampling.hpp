#pragma once
/// Towards a light: draw a direction in which light arrives, and say how likely any direction was.
///
///   pdf_solid_angle = P(light) · pdf(direction | light)
///                   = P(light) · pdf_area · distance² / |cos θ'|     of a point drawn on a surface
///
/// These two pdfs live in different measures, per solid angle and per area: what leaves here is always the first.
///
/// How each kind is sampled, once picked (lights.hpp):
///   triangle     (or two that make a quad) uniformly by area; closer to its centre than it is long, uniformly in the solid angle
///                that it subtends, if that is neither nearly nothing nor nearly a hemisphere
///                (sampling/spherical_triangle.hpp). By area the estimate varies as the cube of the distance where a wall
///                runs past the edge of a lamp: in a Cornell box, whose lamp hangs just below the ceiling, that makes half of
///                the picture's squared error. Farther away both densities are nearly the same, and the one by area costs
///                less. For LightSampling::area, always by area
///   sphere       uniformly in the cone that it subtends; for LightSampling::area, uniformly over its whole
///                surface, of which the far half is wasted. From inside it is dark: it emits outwards
///   point, sun of angle 0     the one direction there is
///   sun          uniformly in its cone
///   sky          by the cosine about the normal: its radiance is the same everywhere, the cosine is not
///   environment  in proportion to its radiance (environment.hpp)
/// Lights from infinity overlap: a direction into the sun's disc is one into the sky as well. So whichever of
/// them was picked, the sample carries the radiance of all and the density of all, Σ P(i) pdf(direction | i).
///
/// Ensures: sample_light_pdf / sample_environment_pdf of what a ray along sample.direction meets is
/// sample.pdf_solid_angle, up to rounding; MIS relies on it. Deltas have no such density and are never met.
/// Thread safety: pure.   Test: tests/scene/test_light_sampling.cpp     Lesson: lessons/04-light-sampling

#include <cmath>
#include <cstdint>
#include <optional>

#include "pathscope/geometry/spawn.hpp"
#include "pathscope/scene/scene.hpp"

namespace pathscope {

struct LightSample {
    Vec3 direction;  ///< From the reference to the light; length one.
    float distance = k_infinity;
    RayTarget target;  ///< The point on the light, if distance is finite.
    Rgb radiance;  ///< That arrives if nothing stands between. Of a delta: irradiance on a plane facing it.
    float pdf_solid_angle = 0;  ///< P(light) included. Of a delta: P(light) alone.
    bool delta = false;
    std::uint32_t light = k_no_light;  ///< The one that was picked.
};

/// Nothing if there is no light, or if the point drawn sends nothing here (its back, a hole, black texels).
/// u_pick chooses the light, u the point. Requires: all in [0, 1).
[[nodiscard]] std::optional<LightSample> sample_light(const Scene& scene, LightSampling sampling,
                                                      const LightReference& reference, float u_pick, Vec2 u);

/// The density with which sample_light draws the direction to this hit; 0 if it is no emitter.
/// Requires: the hit was met by a ray from the reference.
[[nodiscard]] float sample_light_pdf(const Scene& scene, LightSampling sampling,
                                     const LightReference& reference, const SceneHit& hit);

/// The density with which sample_light draws a direction in which a ray met nothing.
[[nodiscard]] float sample_environment_pdf(const Scene& scene, LightSampling sampling,
                                           const LightReference& reference, Vec3 direction);

/// The ray that must meet nothing for the light to arrive.
[[nodiscard]] inline Ray shadow_ray(const SurfacePoint& from, const LightSample& sample) {
    return std::isinf(sample.distance) ? spawn_ray(from, sample.direction)
                                       : spawn_ray_to(from, sample.target);
}

}  // namespace pathscope
