#pragma once
/// From a hit (a distance and two weights) to a point of a surface (all that shading needs).
///
/// The position is taken from the triangle, not from the ray, because origin + t d is off by the rounding of t times
/// the distance, while the weighted mean of the corners is off by its own rounding only:
///
///     p = (1 - u - v) a + u b + v c      in double, rounded once to float
///     |p - exact|_i <= 2^-24 |p_i|
///
/// half a unit in the last place. A ray that leaves it has to keep clear of more than that: the triangle test takes the
/// surface, and all others in the same plane, to be up to 11.5 * 2^-24 R away from where they are, R = the longest side of a
/// triangle (geometry/triangle.hpp). So
///
///     position_error_i = 2^-24 |p_i| + 2^-22 R,    R = longest side in the mesh, if that was measured, else of the triangle
///
/// of which spawn.hpp takes four. Of the mesh, because a poster hangs on a wall that is a hundred times larger.
///
/// The two normals. Winding in files is not to be trusted, vertex normals are: where vertex normals are given, the
/// geometric normal is the one of the two that lies on their side; elsewhere it follows the winding. So
/// dot(geometric_normal, shading_normal) >= 0 always. Both are independent of the ray: the caller compares directions
/// with geometric_normal to tell reflection from transmission.
///
/// Units: scene units; normals have length one. Thread safety: pure.
/// Reference: Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th ed., section 6.8.
/// Test: tests/geometry/test_hit.cpp

#include <cstdint>

#include "pathscope/geometry/mesh.hpp"

namespace pathscope {

/// The point at distance t: (1 - u - v) a + u b + v c of the triangle with this number in Mesh::triangles.
struct Hit {
    float t = 0;
    float u = 0, v = 0;
    std::uint32_t triangle = 0;

    friend bool operator==(const Hit&, const Hit&) = default;
};

struct SurfacePoint {
    Vec3 position;
    Vec3
        position_error;  ///< Per component: how far from `position` rays may take the surface to be, divided by 4.
    Vec3 geometric_normal;  ///< Of the plane of the triangle.
    Vec3 shading_normal;    ///< Interpolated between the vertices; the geometric one where they have none.
    Vec2 uv;                ///< Texture coordinates; (0, 0) if the mesh has none.
    std::uint32_t triangle = 0;
    std::uint32_t material = 0;
};

/// What all hits of a triangle have in common: worked out once, it spares each of them a square root and a quotient.
struct TriangleRecord {
    Vec3 normal;  ///< On the side of the winding, of length one.
    std::uint32_t material = 0;
};

/// Texture coordinates alone, for the cut-out test inside the traversal.
[[nodiscard]] inline Vec2 interpolate_uv(const Mesh& mesh, std::uint32_t triangle, float u, float v) {
    if (mesh.uvs.empty()) return {};
    const TriangleIndices& i = mesh.triangles[triangle];
    return mesh.uvs[i.a] * (1 - u - v) + mesh.uvs[i.b] * u + mesh.uvs[i.c] * v;
}

/// (1 - u - v) a + u b + v c. With weights in double 1 - u - v is exact, so that the point stays in the plane.
[[nodiscard]] inline Vec3 exact_point(const TriangleCorners& t, double u, double v) {
    return to_float((1 - u - v) * to_double(t.a) + u * to_double(t.b) + v * to_double(t.c));
}

/// position_error of such a point. Requires: the longest side of any triangle near.
[[nodiscard]] inline Vec3 position_error(Vec3 position, float longest_side) {
    const float of_test = 0x1p-22f * longest_side;
    return abs(position) * 0x1p-24f + Vec3{of_test, of_test, of_test};
}

/// Fills in both normals where the mesh has normals at its vertices; geometric_normal is that of the winding before.
inline void interpolate_normals(const Mesh& mesh, const Hit& hit, SurfacePoint& point) {
    const auto facing = [](Vec3 n, Vec3 side) { return dot(n, side) < 0 ? -n : n; };
    const TriangleIndices& i = mesh.triangles[hit.triangle];
    Vec3 a = mesh.normals[i.a], b = mesh.normals[i.b], c = mesh.normals[i.c];

    // A corner without a normal takes the geometric one, on the side of those that have one.
    point.geometric_normal = facing(point.geometric_normal, a + b + c);
    for (Vec3* n : {&a, &b, &c})
        if (is_zero(*n)) *n = point.geometric_normal;

    // Within the triangle the interpolated normal can still tip over the plane; the geometric one goes with it.
    const Vec3 interpolated = a * (1 - hit.u - hit.v) + b * hit.u + c * hit.v;
    const float size = length(interpolated);
    point.shading_normal = size > 0 ? interpolated / size : point.geometric_normal;
    point.geometric_normal = facing(point.geometric_normal, point.shading_normal);
}

[[nodiscard]] inline TriangleRecord make_triangle_record(const Mesh& mesh, std::uint32_t triangle) {
    return {geometric_normal(corners(mesh, triangle)), mesh.material_of(triangle)};
}

/// In the place where the caller keeps it: once per hit, and copies of what was just written are slow.
/// Requires: the hit is of a triangle of this mesh that is not degenerate, the record is this triangle's.
inline void fill_surface_point(const Mesh& mesh, const TriangleRecord& record, const Hit& hit,
                               SurfacePoint& point) {
    point.triangle = hit.triangle;
    const TriangleCorners corner = corners(mesh, hit.triangle);
    const float longest = mesh.longest_side > 0 ? mesh.longest_side : longest_side(corner);
    point.material = record.material;
    point.position = exact_point(corner, hit.u, hit.v);
    point.position_error = position_error(point.position, longest);
    point.uv = interpolate_uv(mesh, hit.triangle, hit.u, hit.v);
    point.geometric_normal = point.shading_normal = record.normal;
    if (!mesh.normals.empty()) interpolate_normals(mesh, hit, point);
}

/// The same where there are no records.
[[nodiscard]] inline SurfacePoint surface_point(const Mesh& mesh, const Hit& hit) {
    SurfacePoint point;
    fill_surface_point(mesh, make_triangle_record(mesh, hit.triangle), hit, point);
    return point;
}

}  // namespace pathscope
