#pragma once
/// Where a ray meets a triangle, without a gap between neighbours.
///
/// Move the origin of space to the ray's origin, let z be the axis along which the ray is longest, and shear space so
/// that the ray runs along z:
///
///     A' = (A.x - A.z d.x/d.z,  A.y - A.z d.y/d.z)      for A = a - o; B', C' likewise
///
/// The ray is the point (0, 0) of this plane. It lies in the triangle A'B'C' if it is on one side of all three edges:
///
///     U = C'.x B'.y - C'.y B'.x,   V = A'.x C'.y - A'.y C'.x,   W = B'.x A'.y - B'.y A'.x
///
/// and then U, V, W are the weights of a, b, c, up to their sum.
///
/// Why no light leaks along a shared edge: A' depends on the vertex and the ray only, so neighbours see the same
/// 2D points; W of one is -W of the other, bit for bit; and rounding keeps order: where two rounded products differ, they
/// differ that way before it. Where they do not, the difference is zero, the edge counts as met, and both neighbours claim the
/// ray. So it is never outside of both (see traverse.hpp for which one counts).
///
/// All in floats, because eight of them fit where four doubles do. With u = 2^-24, M the largest |coordinate| of the corners
/// as seen from the ray's origin, and weights that are not negative and add up to one: the point of the triangle that has
/// these weights lies within
///
///     5 u M along x and y    (of A': origin 1, z 1, shear 1, product and sum 2)
///     9 u M along z          (of t d.z: weights 4, products and sums 3, origin 1, 1/d.z 1)
///
/// of the point of the ray at t. A triangle that a ray leaves can thus be met again up to 11.5 u M above it: spawn.hpp moves
/// origins farther than that, and box_ray.hpp widens boxes by more.
///
/// Ensures: degenerate triangles and triangles seen exactly edge-on are never hit. No absolute epsilon; scenes may be of
/// any size from 2^-40 to 2^40, where products of two lengths stay well within the range of floats.
/// Thread safety: pure.   Source: Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1).
/// Test: tests/geometry/test_triangle.cpp

#include <array>
#include <optional>

#include "pathscope/geometry/mesh.hpp"
#include "pathscope/math/fused.hpp"
#include "pathscope/math/ray.hpp"

namespace pathscope {

/// A corner as an array: the test reads its axes in the order that suits the ray.
using Corner = std::array<float, 3>;

[[nodiscard]] constexpr Corner as_corner(Vec3 v) { return {v.x, v.y, v.z}; }

/// What the test needs of a ray, made once per ray: its origin and shear in permuted axes.
struct TriangleRay {
    int x, y, z;                         ///< Axes; z is that of the longest direction component.
    float origin_x, origin_y, origin_z;  ///< Permuted.
    float shear_x, shear_y, inverse_z;   ///< -d.x/d.z, -d.y/d.z, 1/d.z
    float t_min;

    explicit TriangleRay(const Ray& ray);
};

/// The point origin + t direction = (1 - u - v) a + u b + v c.
struct TriangleHit {
    float t, u, v;
};

/// Hits with t in [ray.t_min, t_max], from both sides.
[[nodiscard]] std::optional<TriangleHit> intersect_triangle(const TriangleRay& ray, const Corner& a,
                                                            const Corner& b, const Corner& c, float t_max);

/// The same for a triangle that is known not to be degenerate: trees leave out those that are.
[[nodiscard]] std::optional<TriangleHit> intersect_proper_triangle(const TriangleRay& ray, const Corner& a,
                                                                   const Corner& b, const Corner& c,
                                                                   float t_max);

/// The same for a single test.
[[nodiscard]] inline std::optional<TriangleHit> intersect_triangle(const Ray& ray,
                                                                   const TriangleCorners& triangle) {
    return intersect_triangle(TriangleRay(ray), as_corner(triangle.a), as_corner(triangle.b),
                              as_corner(triangle.c), ray.t_max);
}

// ---------------------------------------------------------------------------------------------------------------
// Inline, because it runs about ten times per ray.

inline TriangleRay::TriangleRay(const Ray& ray) : t_min(ray.t_min) {
    const Vec3 size = abs(ray.direction);
    z = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    x = z == 2 ? 0 : z + 1;
    y = x == 2 ? 0 : x + 1;
    origin_x = ray.origin[x];
    origin_y = ray.origin[y];
    origin_z = ray.origin[z];
    inverse_z = 1 / ray.direction[z];
    shear_x = -ray.direction[x] / ray.direction[z];
    shear_y = -ray.direction[y] / ray.direction[z];
}

inline std::optional<TriangleHit> intersect_proper_triangle(const TriangleRay& ray, const Corner& a,
                                                            const Corner& b, const Corner& c, float t_max) {
    const float a_z = a[ray.z] - ray.origin_z;
    const float b_z = b[ray.z] - ray.origin_z;
    const float c_z = c[ray.z] - ray.origin_z;
    const float a_x = fused_multiply_add(ray.shear_x, a_z, a[ray.x] - ray.origin_x);
    const float a_y = fused_multiply_add(ray.shear_y, a_z, a[ray.y] - ray.origin_y);
    const float b_x = fused_multiply_add(ray.shear_x, b_z, b[ray.x] - ray.origin_x);
    const float b_y = fused_multiply_add(ray.shear_y, b_z, b[ray.y] - ray.origin_y);
    const float c_x = fused_multiply_add(ray.shear_x, c_z, c[ray.x] - ray.origin_x);
    const float c_y = fused_multiply_add(ray.shear_y, c_z, c[ray.y] - ray.origin_y);

    // A zero is on the edge, and belongs to both sides.
    const float u = c_x * b_y - c_y * b_x;
    const float v = a_x * c_y - a_y * c_x;
    const float w = b_x * a_y - b_y * a_x;
    if (!(u >= 0 && v >= 0 && w >= 0) && !(u <= 0 && v <= 0 && w <= 0)) return std::nullopt;

    // All of one sign: the sum is zero only if all are, and then the triangle is seen edge-on.
    const float sum = u + v + w;
    if (sum == 0) return std::nullopt;
    const float inverse_sum = 1 / sum;
    const float weight_b = v * inverse_sum, weight_c = w * inverse_sum;
    const float t = (u * inverse_sum * a_z + weight_b * b_z + weight_c * c_z) * ray.inverse_z;
    if (!(t >= ray.t_min && t <= t_max)) return std::nullopt;
    return TriangleHit{t, weight_b, weight_c};
}

inline std::optional<TriangleHit> intersect_triangle(const TriangleRay& ray, const Corner& a, const Corner& b,
                                                     const Corner& c, float t_max) {
    const auto hit = intersect_proper_triangle(ray, a, b, c, t_max);
    // Corners on one line can be spread by the rounding of the shear; this is the exact answer.
    if (hit && is_degenerate({{a[0], a[1], a[2]}, {b[0], b[1], b[2]}, {c[0], c[1], c[2]}}))
        return std::nullopt;
    return hit;
}

}  // namespace pathscope
