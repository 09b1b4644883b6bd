#pragma once
/// Does a ray meet a box? An answer that may say yes too often by a hair, and never no.
///
/// A box is the intersection of three slabs. The ray is in the slab of axis i between
///
///     t_near_i = (near plane_i - o_i) / d_i    and    t_far_i = (far plane_i - o_i) / d_i
///
/// and in the box where all three intervals overlap. Two traps, and the ways around them:
///
/// - Rounding. Each t is off by three roundings, up to 3 * 2^-24 of itself: a ray through an edge of the box, or
///   along a face of a flat one, can fall between near and far. And the triangle test (geometry/triangle.hpp) has an error
///   of its own, up to 9 * 2^-24 of the distances along an axis, by which a hit may stick out of its box. So the origin is
///   moved, towards the near planes for t_near and away from the far ones for t_far, by 16 * 2^-24 of the scene, of which
///   both together take 12, and by 4 * 2^-24 of itself, of which rounding the sum takes one.
/// - Division by zero. A direction component of 0 has an infinite inverse, and 0 * infinity is NaN where the origin is
///   on a plane. The moved origin is not: where the origin is on the border of the slab, it is inside, and the products
///   are -infinity and +infinity.
///
/// Ensures: if intersect_triangle() reports a hit at t for a triangle inside the box, and t is in [t_min, t_max], then
/// the box is met, with t_near <= t. This is what makes the closest hit independent of the tree.
/// Thread safety: pure.   Source: Ize 2013, "Robust BVH Ray Traversal", JCGT 2(2); the moved origin is
/// that of Woop, Benthin, Wald 2013.
/// Test: tests/bvh/test_box_ray.cpp

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "pathscope/math/box.hpp"
#include "pathscope/math/ray.hpp"

namespace pathscope {

/// By how much boxes are widened, as a share of the scene's reach from the ray's origin.
inline constexpr float k_box_widening = 0x1p-20f;

/// Where the planes of one axis lie in BvhNode::bounds, as seen by the ray.
struct SlabPlanes {
    std::size_t near, far;
};

struct BoxRay {
    Vec3 near_origin, far_origin;
    Vec3 inverse;  ///< 1 / direction; infinite where that is zero, with its sign.
    SlabPlanes x, y, z;

    /// scene: encloses all boxes that will be tested.
    BoxRay(const Ray& ray, const Box& scene)
        : x(planes(ray.direction, 0)), y(planes(ray.direction, 1)), z(planes(ray.direction, 2)) {
        const Vec3 reach = max(abs(scene.low - ray.origin), abs(scene.high - ray.origin));
        const float error = k_box_widening * max_component(reach);
        for (int axis = 0; axis < 3; ++axis) {
            const float shift =
                std::copysign(std::abs(ray.origin[axis]) * 0x1p-22f + error, ray.direction[axis]);
            near_origin[axis] = ray.origin[axis] + shift;
            far_origin[axis] = ray.origin[axis] - shift;
            inverse[axis] = 1 / ray.direction[axis];
        }
    }

  private:
    static SlabPlanes planes(Vec3 direction, std::size_t axis) {
        const bool backward = std::signbit(direction[static_cast<int>(axis)]);
        return backward ? SlabPlanes{axis + 3, axis} : SlabPlanes{axis, axis + 3};
    }
};

struct BoxInterval {
    float t_near, t_far;

    [[nodiscard]] bool met() const { return t_near <= t_far; }
};

/// bounds: low x, y, z, high x, y, z.
[[nodiscard]] inline BoxInterval intersect_box(const BoxRay& ray, const std::array<float, 6>& bounds,
                                               float t_min, float t_max) {
    const float near_x = (bounds[ray.x.near] - ray.near_origin.x) * ray.inverse.x;
    const float near_y = (bounds[ray.y.near] - ray.near_origin.y) * ray.inverse.y;
    const float near_z = (bounds[ray.z.near] - ray.near_origin.z) * ray.inverse.z;
    const float far_x = (bounds[ray.x.far] - ray.far_origin.x) * ray.inverse.x;
    const float far_y = (bounds[ray.y.far] - ray.far_origin.y) * ray.inverse.y;
    const float far_z = (bounds[ray.z.far] - ray.far_origin.z) * ray.inverse.z;
    return {std::max(std::max(near_x, near_y), std::max(near_z, t_min)),
            std::min(std::min(far_x, far_y), std::min(far_z, t_max))};
}

}  // namespace pathscope
