#pragma once
/// Rays that leave a surface without hitting it again.
///
/// The triangle test finds the surface within four error boxes e around a stored position (hit.hpp), on either side. Along the
/// geometric normal n a box reaches D = sum_i |n_i| e_i, so the origin is moved by
///
///     k D,   k = 4:   of the position's 2^-24, one D for itself, one for rounding the moved origin to float, two to spare;
///                     of the test's 2^-22 R, 16 * 2^-24 R, where 11.5 are needed
///
/// to the side that the direction points to. This is an offset of a few units in the last place of the largest coordinates at
/// any scale of scene and any distance from the origin of space: no epsilon to tune, no t_min. The same margin clears
/// all triangles in the same plane. Use the geometric normal, never the shading
/// normal: only the former knows where the surface is.
///
/// A shadow ray has two ends to keep clear. It ends at the target moved off the light's surface in the same way, by an
/// error to which 5 * 2^-24 of the distance L is added, four times: from so far away the triangle test is off by 11.5 * 2^-24 L, and
/// the rounding of direction and length carry the end of the ray by some more.
///
/// Ensures: direction of length one. Thread safety: pure.
/// Reference: Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th ed., section 6.8.6.
/// Test: tests/geometry/test_spawn.cpp (no self-hit at sizes 1e-3, 1, 1e5, also 1000 sizes from the origin)

#include "pathscope/geometry/hit.hpp"
#include "pathscope/math/ray.hpp"

namespace pathscope {

inline constexpr float k_offset_safety = 4;

/// Moves a position off the surface that it lies on, to the side that `direction` points to. Requires: normal of
/// length one; error >= 0, with the rounding of the position itself included (hit.hpp).
[[nodiscard]] inline Vec3 offset_origin(Vec3 position, Vec3 error, Vec3 geometric_normal, Vec3 direction) {
    const float distance = k_offset_safety * dot(abs(geometric_normal), error);
    const float side = dot(direction, geometric_normal) + 0.0f;  // Makes -0 +0.
    return position + geometric_normal * std::copysign(distance, side);
}

/// Requires: direction of length one.
[[nodiscard]] inline Ray spawn_ray(const SurfacePoint& point, Vec3 direction) {
    return {offset_origin(point.position, point.position_error, point.geometric_normal, direction),
            direction};
}

/// A point to aim at: on a light, or any other surface.
struct RayTarget {
    Vec3 position;
    Vec3 position_error;
    Vec3
        normal;  ///< Geometric, of length one, either side; zero if there is no surface (nothing to keep clear of).
};

/// The segment between the two surfaces, for visibility: whatever it hits stands between them. Where the two are
/// closer than their errors the segment is empty (t_max < t_min) and nothing stands between.
[[nodiscard]] inline Ray spawn_ray_to(const SurfacePoint& point, const RayTarget& target) {
    const Vec3 between = target.position - point.position;
    const Vec3 origin = offset_origin(point.position, point.position_error, point.geometric_normal, between);

    // At the far end the test and the ray's drift err by a share of the distance.
    const float from_afar = 5 * 0x1p-24f * max_component(abs(between));
    const Vec3 target_error = target.position_error + Vec3{from_afar, from_afar, from_afar};
    const Vec3 end = offset_origin(target.position, target_error, target.normal, -between);

    const Vec3 segment = end - origin;
    const float distance = length(segment);
    if (!(dot(segment, between) > 0)) return {origin, point.geometric_normal, 0, -1};
    return {origin, segment / distance, 0, distance};
}

[[nodiscard]] inline Ray spawn_ray_to(const SurfacePoint& point, const SurfacePoint& target) {
    return spawn_ray_to(point, RayTarget{target.position, target.position_error, target.geometric_normal});
}

}  // namespace pathscope
