#include "pathscope/geometry/hit.hpp"

#include "geometry/double_vec.hpp"

namespace pathscope {
namespace {

struct CornerNormals {
    Vec3 a, b, c;
};

/// Double weights: 1 - u - v is then exact, so that the point stays in the triangle's plane.
Vec3 weighted_mean(const TriangleCorners& t, double u, double v) {
    return to_float((1 - u - v) * to_double(t.a) + u * to_double(t.b) + v * to_double(t.c));
}

Vec3 position_error(const TriangleCorners& triangle, Vec3 position) {
    const float rounding_in_double = 0x1p-32f * max_component(bounds(triangle).extent());
    return abs(position) * 0x1p-24f + Vec3{rounding_in_double, rounding_in_double, rounding_in_double};
}

Vec3 facing(Vec3 n, Vec3 side) { return dot(n, side) < 0 ? -n : n; }

CornerNormals corner_normals(const Mesh& mesh, std::uint32_t triangle) {
    const TriangleIndices& i = mesh.triangles[triangle];
    return {mesh.normals[i.a], mesh.normals[i.b], mesh.normals[i.c]};
}

}  // namespace

SurfacePoint surface_point(const Mesh& mesh, const Hit& hit) {
    const TriangleCorners triangle = corners(mesh, hit.triangle);
    SurfacePoint point;
    point.triangle = hit.triangle;
    point.material = mesh.material_of(hit.triangle);
    point.position = weighted_mean(triangle, hit.u, hit.v);
    point.position_error = position_error(triangle, point.position);
    point.uv = interpolate_uv(mesh, hit.triangle, hit.u, hit.v);
    point.geometric_normal = geometric_normal(triangle);
    point.shading_normal = point.geometric_normal;
    if (mesh.normals.empty()) return point;

    // A corner without a normal takes the geometric one, on the side of those that have one.
    auto [a, b, c] = corner_normals(mesh, hit.triangle);
    point.geometric_normal = facing(point.geometric_normal, a + b + c);
    for (Vec3* n : {&a, &b, &c})
        if (is_zero(*n)) *n = point.geometric_normal;

    // Within the triangle the interpolated normal can still tip over the plane; the geometric one goes with it.
    const Vec3 interpolated = a * (1 - hit.u - hit.v) + b * hit.u + c * hit.v;
    const float size = length(interpolated);
    point.shading_normal = size > 0 ? interpolated / size : point.geometric_normal;
    point.geometric_normal = facing(point.geometric_normal, point.shading_normal);
    return point;
}

}  // namespace pathscope
