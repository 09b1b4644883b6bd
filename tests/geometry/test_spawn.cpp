#include "pathscope/geometry/spawn.hpp"

#include <array>

#include "geometry/test_meshes.hpp"
#include "pathscope/geometry/triangle.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// Below this cosine the stored normal, itself rounded to 2^-24, does not tell towards from away.
constexpr float k_tangent = 1e-6f;

/// The triangle as another modeller would have written it: turned, and turned and flipped.
std::array<TriangleCorners, 3> copies(const TriangleCorners& t) {
    return {t, TriangleCorners{t.b, t.c, t.a}, TriangleCorners{t.c, t.b, t.a}};
}

SurfacePoint random_surface_point(const Mesh& mesh, std::uint32_t triangle, HashRng& rng) {
    const float root = std::sqrt(rng.next_float());
    return surface_point(mesh, {1, 1 - root, rng.next_float() * root, triangle});
}

/// True if the point may lie on either side of the surface: nothing is to be said about visibility then.
bool in_tangent_plane(const SurfacePoint& surface, Vec3 position, Vec3 error) {
    const Vec3 between = position - surface.position;
    const float uncertain = 8 * dot(abs(surface.geometric_normal), error + surface.position_error);
    return std::abs(dot(between, surface.geometric_normal)) <= k_tangent * length(between) + uncertain;
}

/// Calls body(mesh) for three meshes, each at three sizes, at the origin of space and 1000 sizes away from it.
template <class Body>
void for_each_setting(Body&& body) {
    const Vec3 away = Vec3{0.7f, -0.4f, 0.59f} * 1000;
    for (const Mesh& mesh : {random_soup(200, 1), bumpy_sphere(3, 2), box_interior(4)})
        for (const float scale : {1e-3f, 1.0f, 1e5f})
            for (const float distance : {0.0f, 1.0f}) {
                CAPTURE(scale);
                CAPTURE(distance);
                body(scaled_and_moved(mesh, scale, away * (distance * scale)));
            }
}

}  // namespace

TEST_CASE("a ray that leaves a surface never hits the triangle it left, nor a coincident copy") {
    HashRng rng(1);
    for_each_setting([&](const Mesh& mesh) {
        int rays = 0, hits = 0;
        for (int i = 0; i < 6000; ++i) {
            const std::uint32_t triangle = rng.next_u32() % mesh.triangle_count();
            const TriangleCorners t = corners(mesh, triangle);
            if (is_degenerate(t)) continue;
            const SurfacePoint point = random_surface_point(mesh, triangle, rng);
            Vec3 direction = random_direction(rng);
            if (i % 4 == 0)
                direction = normalize(direction - point.geometric_normal *
                                                      (0.999f * dot(direction, point.geometric_normal)));
            if (std::abs(dot(direction, point.geometric_normal)) < k_tangent) continue;
            ++rays;
            for (const TriangleCorners& copy : copies(t))
                hits += intersect_triangle(spawn_ray(point, direction), copy).has_value();
        }
        CHECK(rays > 4000);
        CHECK(hits == 0);
    });
}

TEST_CASE("without the offset such rays do hit: the test above can fail") {
    HashRng rng(1);
    const Mesh mesh = random_soup(200, 1);
    int hits = 0;
    for (int i = 0; i < 2000; ++i) {
        const std::uint32_t triangle = rng.next_u32() % mesh.triangle_count();
        const SurfacePoint point = random_surface_point(mesh, triangle, rng);
        hits +=
            intersect_triangle({point.position, random_direction(rng)}, corners(mesh, triangle)).has_value();
    }
    CHECK(hits > 500);
}

TEST_CASE("a decal in the plane of a floor that is 1000 times larger does not see the floor") {
    HashRng rng(2);
    for (const float height : {0.0f, 1.0f, 123.4f}) {
        const TriangleCorners floor{{-700, height, -400}, {900, height, -300}, {-100, height, 800}};
        Mesh decal;
        add_quad(decal, {0.1f, height, 0.2f}, {1, 0, 0}, {0, 0, 1});
        decal.longest_side = longest_side(floor);  // Of the mesh that both are part of.
        for (int i = 0; i < 20000; ++i) {
            const SurfacePoint point = random_surface_point(decal, i % 2, rng);
            const Vec3 direction = random_direction(rng);
            if (std::abs(direction.y) < k_tangent) continue;
            CHECK_FALSE(intersect_triangle(spawn_ray(point, direction), floor));
        }
    }
}

TEST_CASE("the offset is a few units in the last place of the largest coordinates") {
    HashRng rng(3);
    for_each_setting([&](const Mesh& mesh) {
        for (std::uint32_t i = 0; i < 200; ++i) {
            if (is_degenerate(corners(mesh, i))) continue;
            const SurfacePoint point = random_surface_point(mesh, i, rng);
            const float size = max_component(bounds(corners(mesh, i)).extent());
            const Vec3 moved = spawn_ray(point, random_direction(rng)).origin - point.position;
            CHECK(length(moved) <= 16 * 0x1p-24f * length(point.position) + 0x1p-19f * size);
        }
    });
}

TEST_CASE("a ray goes to the side that its direction points to") {
    Mesh mesh;
    add_quad(mesh, {0, 1, 0}, {0, 0, 1}, {1, 0, 0});
    const SurfacePoint point = surface_point(mesh, {1, 0.25f, 0.25f, 0});
    CHECK(point.geometric_normal == Vec3{0, 1, 0});
    CHECK(spawn_ray(point, normalize(Vec3{1, 0.1f, 0})).origin.y > 1);
    CHECK(spawn_ray(point, normalize(Vec3{1, -0.1f, 0})).origin.y < 1);
}

TEST_CASE("a shadow ray hits neither the surface it starts on nor the one it aims at") {
    HashRng rng(4);
    for_each_setting([&](const Mesh& mesh) {
        int rays = 0, hits = 0;
        for (int i = 0; i < 6000; ++i) {
            const std::uint32_t from = rng.next_u32() % mesh.triangle_count();
            const std::uint32_t to = rng.next_u32() % mesh.triangle_count();
            if (is_degenerate(corners(mesh, from)) || is_degenerate(corners(mesh, to))) continue;
            const SurfacePoint start = random_surface_point(mesh, from, rng);
            const SurfacePoint end = random_surface_point(mesh, to, rng);
            if (in_tangent_plane(start, end.position, end.position_error)) continue;
            if (in_tangent_plane(end, start.position, start.position_error)) continue;
            ++rays;
            const Ray ray = spawn_ray_to(start, end);
            for (const TriangleCorners& copy : copies(corners(mesh, from)))
                hits += intersect_triangle(ray, copy).has_value();
            for (const TriangleCorners& copy : copies(corners(mesh, to)))
                hits += intersect_triangle(ray, copy).has_value();
        }
        CHECK(rays > 3000);
        CHECK(hits == 0);
    });
}

TEST_CASE("a shadow ray from far away does not hit the small light it aims at") {
    // At the origin of space the light's own error is tiny; what counts is where a ray of 3000 lights' lengths ends.
    HashRng rng(5);
    const Mesh light = random_soup(200, 6);
    int rays = 0, hits = 0;
    for (int i = 0; i < 20000; ++i) {
        const std::uint32_t triangle = rng.next_u32() % light.triangle_count();
        const SurfacePoint end = random_surface_point(light, triangle, rng);
        SurfacePoint start;
        start.position = random_direction(rng) * 3000;
        start.position_error = abs(start.position) * 0x1p-24f;
        start.geometric_normal = random_direction(rng);
        if (in_tangent_plane(end, start.position, start.position_error)) continue;
        ++rays;
        for (const TriangleCorners& copy : copies(corners(light, triangle)))
            hits += intersect_triangle(spawn_ray_to(start, end), copy).has_value();
    }
    CHECK(rays > 15000);
    CHECK(hits == 0);
}

TEST_CASE("a shadow ray spans what lies between, and has length one") {
    Mesh mesh;
    add_quad(mesh, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
    add_quad(mesh, {-1, 5, -1}, {0, 0, 2}, {2, 0, 0});
    const SurfacePoint start = surface_point(mesh, {1, 0.5f, 0, 0});
    const SurfacePoint end = surface_point(mesh, {1, 0.5f, 0, 2});
    const Ray ray = spawn_ray_to(start, end);
    CHECK(length(ray.direction) == doctest::Approx(1).epsilon(1e-6));
    CHECK(ray.t_min == 0);
    CHECK(ray.t_max < 5);
    CHECK(ray.t_max > 5 * (1 - 1e-5f));
    CHECK(intersect_triangle(ray, {{-9, 4.9999f, -9}, {9, 4.9999f, -9}, {0, 4.9999f, 9}}));
    CHECK(intersect_triangle(ray, {{-9, 0.0001f, -9}, {9, 0.0001f, -9}, {0, 0.0001f, 9}}));
}

TEST_CASE("a target without a surface, and one that is the start itself") {
    Mesh mesh;
    add_quad(mesh, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
    const SurfacePoint start = surface_point(mesh, {1, 0.5f, 0, 0});
    const Ray to_point = spawn_ray_to(start, RayTarget{start.position + Vec3{0, 2, 0}, {}, {}});
    CHECK(to_point.t_max == doctest::Approx(2).epsilon(1e-5));
    const Ray nowhere = spawn_ray_to(start, start);
    CHECK(nowhere.t_max < nowhere.t_min);
    CHECK(is_finite(nowhere.direction));
}
