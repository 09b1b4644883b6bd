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
/// 2D points; W of one is -W of the other, bit for bit; and its sign is exact: if two products differ after
/// rounding, then they differ that way before it, and if they do not, their rounding errors are compared. So the ray
/// is never outside of both. A ray through an edge hits both neighbours (see traverse.hpp for which one counts).
///
/// Why double: the hit is exact but for about 2^-50 of the triangle's size, so that origins need to be moved off the
/// surface only by the rounding of the stored position (spawn.hpp), be the triangle ever so large. A
/// float version would see the triangle displaced by 6 * 2^-24 of its size.
///
/// Ensures: degenerate triangles and triangles seen exactly edge-on are never hit. No absolute epsilon.
/// Thread safety: pure.   Source: Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1).
/// Test: tests/geometry/test_triangle.cpp

#include <array>
#include <optional>

#include "pathscope/geometry/double_vec.hpp"
#include "pathscope/geometry/mesh.hpp"
#include "pathscope/math/ray.hpp"

namespace pathscope {

/// A corner as an array: the test reads its axes in the order that suits the ray.
using Corner = std::array<float, 3>;

[[nodiscard]] constexpr Corner as_corner(Vec3 v) { return {v.x, v.y, v.z}; }

/// What the test needs of a ray, made once per ray: its origin and shear in permuted axes.
struct TriangleRay {
    int x, y, z;                          ///< Axes; z is that of the longest direction component.
    double origin_x, origin_y, origin_z;  ///< Permuted.
    double shear_x, shear_y, inverse_z;   ///< d.x/d.z, d.y/d.z, 1/d.z
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
    inverse_z = 1.0 / ray.direction[z];
    shear_x = ray.direction[x] * inverse_z;
    shear_y = ray.direction[y] * inverse_z;
}

inline std::optional<TriangleHit> intersect_proper_triangle(const TriangleRay& ray, const Corner& a,
                                                            const Corner& b, const Corner& c, float t_max) {
    const double a_z = a[ray.z] - ray.origin_z;
    const double b_z = b[ray.z] - ray.origin_z;
    const double c_z = c[ray.z] - ray.origin_z;
    const double a_x = a[ray.x] - ray.origin_x - ray.shear_x * a_z;
    const double a_y = a[ray.y] - ray.origin_y - ray.shear_y * a_z;
    const double b_x = b[ray.x] - ray.origin_x - ray.shear_x * b_z;
    const double b_y = b[ray.y] - ray.origin_y - ray.shear_y * b_z;
    const double c_x = c[ray.x] - ray.origin_x - ray.shear_x * c_z;
    const double c_y = c[ray.y] - ray.origin_y - ray.shear_y * c_z;

    // A zero is on the edge, and belongs to both sides.
    const double u = difference_of_products(c_x, b_y, c_y, b_x);
    const double v = difference_of_products(a_x, c_y, a_y, c_x);
    const double w = difference_of_products(b_x, a_y, b_y, a_x);
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return std::nullopt;

    // All of one sign: the sum is zero only if all are, and then the triangle is seen edge-on.
    const double sum = u + v + w;
    if (sum == 0) return std::nullopt;
    const double inverse_sum = 1.0 / sum;
    const auto t = static_cast<float>((u * a_z + v * b_z + w * c_z) * inverse_sum * ray.inverse_z);
    if (!(t >= ray.t_min && t <= t_max)) return std::nullopt;
    return TriangleHit{t, static_cast<float>(v * inverse_sum), static_cast<float>(w * inverse_sum)};
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
