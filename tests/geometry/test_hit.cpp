#include "pathscope/geometry/hit.hpp"

#include "geometry/test_meshes.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// Counter-clockwise seen from +z.
Mesh one_triangle() {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    return mesh;
}

Hit hit_at(float u, float v) { return {1, u, v, 0}; }

}  // namespace

TEST_CASE("the position is within the stated error of the exact weighted mean") {
    HashRng rng(1);
    for (const float scale : {1e-3f, 1.0f, 1e5f}) {
        for (const float distance : {0.0f, 1.0f, 1000.0f}) {
            const Mesh mesh =
                scaled_and_moved(random_soup(300, 1), scale, Vec3{1, -0.7f, 0.3f} * (distance * scale));
            float largest_share = 0;
            for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
                const float root = std::sqrt(rng.next_float()), v = rng.next_float() * root;
                const Hit hit{1, 1 - root, v, i};
                const SurfacePoint point = surface_point(mesh, hit);
                const TriangleCorners t = corners(mesh, i);
                for (int axis = 0; axis < 3; ++axis) {
                    const long double u = hit.u, w = 1.0L - u - hit.v;
                    const long double exact =
                        w * t.a[axis] + u * t.b[axis] + hit.v * (long double)(t.c[axis]);
                    const auto error = static_cast<float>(std::abs(point.position[axis] - exact));
                    CHECK(error <= point.position_error[axis]);
                    largest_share = std::max(largest_share, error / point.position_error[axis]);
                }
            }
            CHECK(largest_share > 0.5f);  // the bound is no larger than it has to be
        }
    }
}

TEST_CASE("without normals in the mesh, both normals follow the winding") {
    Mesh mesh = one_triangle();
    CHECK(surface_point(mesh, hit_at(0.2f, 0.3f)).geometric_normal == Vec3{0, 0, 1});
    CHECK(surface_point(mesh, hit_at(0.2f, 0.3f)).shading_normal == Vec3{0, 0, 1});
    std::swap(mesh.triangles[0].b, mesh.triangles[0].c);
    CHECK(surface_point(mesh, hit_at(0.2f, 0.3f)).geometric_normal == Vec3{0, 0, -1});
}

TEST_CASE("the shading normal is interpolated and has length one") {
    Mesh mesh = one_triangle();
    mesh.normals = {{0, 0, 1}, {1, 0, 0}, {0, 1, 0}};
    CHECK(surface_point(mesh, hit_at(0, 0)).shading_normal == Vec3{0, 0, 1});
    CHECK(surface_point(mesh, hit_at(1, 0)).shading_normal == Vec3{1, 0, 0});
    const Vec3 n = surface_point(mesh, hit_at(0.25f, 0.25f)).shading_normal;
    CHECK(length(n - normalize(Vec3{0.25f, 0.25f, 0.5f})) < 1e-6f);
}

TEST_CASE("vertex normals decide the side of the geometric normal, against the winding") {
    Mesh mesh = one_triangle();
    mesh.normals.assign(3, normalize(Vec3{0.1f, 0.2f, -1}));
    const SurfacePoint point = surface_point(mesh, hit_at(0.3f, 0.3f));
    CHECK(point.geometric_normal == Vec3{0, 0, -1});
    CHECK(dot(point.shading_normal, point.geometric_normal) > 0);
}

TEST_CASE("a corner without a normal takes the geometric one, on the side of the others") {
    Mesh mesh = one_triangle();
    mesh.normals = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
    CHECK(surface_point(mesh, hit_at(0.3f, 0.3f)).shading_normal == Vec3{0, 0, 1});
    const Vec3 given = normalize(Vec3{1, 0, -1});
    mesh.normals = {{0, 0, 0}, given, given};
    CHECK(surface_point(mesh, hit_at(0, 0)).shading_normal == Vec3{0, 0, -1});
    CHECK(length(surface_point(mesh, hit_at(1, 0)).shading_normal - given) < 1e-6f);
}

TEST_CASE("opposite vertex normals that cancel leave the geometric normal") {
    Mesh mesh = one_triangle();
    mesh.normals = {{0, 0, 1}, {0, 0, -1}, {0, 0, 1}};
    const SurfacePoint point = surface_point(mesh, hit_at(0.5f, 0));
    CHECK(length(point.shading_normal) == 1);
    CHECK(dot(point.shading_normal, point.geometric_normal) == 1);
}

TEST_CASE("the two normals are on one side, for any vertex normals") {
    HashRng rng(2);
    Mesh mesh = random_soup(2000, 3);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) mesh.normals.push_back(random_direction(rng));
    for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
        const SurfacePoint point =
            surface_point(mesh, {1, 0.5f * rng.next_float(), 0.5f * rng.next_float(), i});
        CHECK(dot(point.geometric_normal, point.shading_normal) >= 0);
        CHECK(length(point.shading_normal) == doctest::Approx(1).epsilon(1e-5));
    }
}

TEST_CASE("texture coordinates and material come with the point") {
    Mesh mesh = one_triangle();
    CHECK(surface_point(mesh, hit_at(0.5f, 0.5f)).uv == Vec2{0, 0});
    mesh.uvs = {{0, 0}, {2, 0}, {0, 4}};
    mesh.materials = {9};
    const SurfacePoint point = surface_point(mesh, hit_at(0.5f, 0.25f));
    CHECK(point.uv == Vec2{1, 1});
    CHECK(point.material == 9);
    CHECK(interpolate_uv(mesh, 0, 0.5f, 0.25f) == point.uv);
}
