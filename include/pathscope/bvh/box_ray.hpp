#pragma once
/// Does a ray meet a box? An answer that may say yes too often by a hair, and never no.
///
/// A box is the intersection of three slabs. The ray is in the slab of axis i between
///
///     t_near_i = (near plane_i - o_i) / d_i    and    t_far_i = (far plane_i - o_i) / d_i
///
/// and in the box where all three intervals overlap. Three traps, and the ways around them:
///
/// - Rounding. Each t is off by three roundings, up to 3 * 2^-24 of itself: a ray through an edge of the box, or
///   along a face of a flat one, can fall between near and far. So far is stretched by 1 + 2^-21.
/// - The triangle test (geometry/triangle.hpp) has an error of its own, about 2^-50 of the distances, by which a hit
///   may stick out of its box. So the origin is moved towards the box on each side: back for near planes, ahead for
///   far ones, by 2^-48 of the scene plus an ulp of the origin.
/// - Division by zero. A direction component of 0 gives 0 * infinity = NaN where the origin is on a plane. So its
///   inverse is the largest float instead of infinity; with the moved origin no product is 0.
///
/// Ensures: if intersect_triangle() reports a hit at t for a triangle inside the box, and t is in [t_min, t_max], then
/// the box is met, with t_near <= t * (1 + 2^-21). This is what makes the closest hit independent of the tree.
/// Thread safety: pure.   Source: Ize 2013, "Robust BVH Ray Traversal", JCGT 2(2); the moved origin is
/// that of Woop, Benthin, Wald 2013, with the error of a test in double.
/// Test: tests/bvh/test_box_ray.cpp

#include <algorithm>
#include <array>

#include "pathscope/math/box.hpp"
#include "pathscope/math/ray.hpp"

namespace pathscope {

inline constexpr float k_far_stretch = 1 + 0x1p-21f;

struct BoxRay {
    Vec3 near_origin, far_origin;
    Vec3 inverse;                ///< 1 / direction, finite.
    int near_x, near_y, near_z;  ///< 0 if the near plane is the low one, 3 if it is the high one.

    /// scene: encloses all boxes that will be tested.
    BoxRay(const Ray& ray, const Box& scene) {
        const Vec3 reach = max(abs(scene.low - ray.origin), abs(scene.high - ray.origin));
        const float error = 0x1p-48f * max_component(reach);
        const Vec3 shift = abs(ray.origin) * 0x1p-22f + Vec3{error, error, error};
        for (int axis = 0; axis < 3; ++axis) {
            const bool backward = std::signbit(ray.direction[axis]);
            inverse[axis] = std::clamp(1 / ray.direction[axis], -k_largest, k_largest);
            near_origin[axis] = ray.origin[axis] + (backward ? -shift[axis] : shift[axis]);
            far_origin[axis] = ray.origin[axis] - (backward ? -shift[axis] : shift[axis]);
        }
        near_x = std::signbit(ray.direction.x) ? 3 : 0;
        near_y = std::signbit(ray.direction.y) ? 3 : 0;
        near_z = std::signbit(ray.direction.z) ? 3 : 0;
    }

  private:
    static constexpr float k_largest = std::numeric_limits<float>::max();
};

struct BoxInterval {
    float t_near, t_far;

    [[nodiscard]] bool met() const { return t_near <= t_far; }
};

/// bounds: low x, y, z, high x, y, z.
[[nodiscard]] inline BoxInterval intersect_box(const BoxRay& ray, const std::array<float, 6>& bounds,
                                               float t_min, float t_max) {
    const float near_x = (bounds[ray.near_x] - ray.near_origin.x) * ray.inverse.x;
    const float near_y = (bounds[ray.near_y + 1] - ray.near_origin.y) * ray.inverse.y;
    const float near_z = (bounds[ray.near_z + 2] - ray.near_origin.z) * ray.inverse.z;
    const float far_x = (bounds[3 - ray.near_x] - ray.far_origin.x) * ray.inverse.x;
    const float far_y = (bounds[4 - ray.near_y] - ray.far_origin.y) * ray.inverse.y;
    const float far_z = (bounds[5 - ray.near_z] - ray.far_origin.z) * ray.inverse.z;
    return {std::max(std::max(near_x, near_y), std::max(near_z, t_min)),
            std::min(std::min(far_x, far_y), std::min(far_z, t_max)) * k_far_stretch};
}

}  // namespace pathscope
