#include "pathscope/bvh/traverse.hpp"

#include <array>

#include "bvh/oracle.hpp"
#include "pathscope/geometry/spawn.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

TEST_CASE("closest_hit is brute force, bit for bit, and any_hit tells whether there is one") {
    const int rays_per_mesh = k_sanitized ? 4000 : 33334;
    for (int number = 0; number < 3; ++number) {
        const Mesh mesh = test_mesh(number);
        const Bvh sah = build_bvh(mesh),
                  median = build_bvh(mesh, {.split = BvhSplit::median, .max_leaf_triangles = 2});
        RayMaker rays(mesh, 10 + static_cast<std::uint32_t>(number));
        int hits = 0, differ = 0;
        for (int i = 0; i < rays_per_mesh; ++i) {
            const Ray ray = rays.next();
            if (is_zero_direction(ray)) continue;
            const std::optional<Hit> expected = brute_force(mesh, ray);
            hits += expected.has_value();
            differ += closest_hit(sah, ray) != expected;
            differ += closest_hit(median, ray) != expected;
            differ += any_hit(sah, ray) != expected.has_value();
            differ += any_hit(median, ray) != expected.has_value();
        }
        CAPTURE(number);
        CHECK(differ == 0);
        CHECK(hits > rays_per_mesh / 4);
        CHECK(hits < rays_per_mesh);
    }
}

TEST_CASE("the same far from the origin of space, very small and very large") {
    for (int number = 0; number < 3; ++number)
        for (const float scale : {1e-3f, 1e5f}) {
            const Mesh mesh =
                scaled_and_moved(test_mesh(number), scale, Vec3{0.7f, -0.4f, 0.59f} * (1000 * scale));
            const Bvh bvh = build_bvh(mesh);
            RayMaker rays(mesh, 20 + static_cast<std::uint32_t>(number));
            int hits = 0, differ = 0;
            for (int i = 0; i < 2000; ++i) {
                const Ray ray = rays.next();
                if (is_zero_direction(ray)) continue;
                const std::optional<Hit> expected = brute_force(mesh, ray);
                hits += expected.has_value();
                differ += closest_hit(bvh, ray) != expected;
                differ += any_hit(bvh, ray) != expected.has_value();
            }
            CHECK(differ == 0);
            CHECK(hits > 500);
        }
}

TEST_CASE("accept is honoured: holes are seen through") {
    const auto checkered = [](std::uint32_t triangle, float u, float v) {
        return (static_cast<int>(u * 4) + static_cast<int>(v * 4) + static_cast<int>(triangle)) % 2 == 0;
    };
    for (int number = 0; number < 3; ++number) {
        const Mesh mesh = test_mesh(number);
        const Bvh bvh = build_bvh(mesh);
        RayMaker rays(mesh, 30 + static_cast<std::uint32_t>(number));
        int differ = 0, seen_through = 0;
        for (int i = 0; i < 4000; ++i) {
            const Ray ray = rays.next();
            if (is_zero_direction(ray)) continue;
            const std::optional<Hit> expected = brute_force(mesh, ray, checkered);
            differ += closest_hit(bvh, ray, checkered) != expected;
            differ += any_hit(bvh, ray, checkered) != expected.has_value();
            seen_through += closest_hit(bvh, ray) != expected;
        }
        CHECK(differ == 0);
        CHECK(seen_through > 500);
    }
    const Mesh mesh = test_mesh(0);
    const auto nothing = [](std::uint32_t, float, float) { return false; };
    CHECK_FALSE(closest_hit(build_bvh(mesh), {{-1, 0.5f, 0.5f}, {1, 0, 0}}, nothing));
    CHECK_FALSE(any_hit(build_bvh(mesh), {{-1, 0.5f, 0.5f}, {1, 0, 0}}, nothing));
}

TEST_CASE("no light leaks out of a closed mesh: rays at its edges and vertices always hit") {
    const int rays = k_sanitized ? 4000 : 40000;
    const Mesh shape = bumpy_sphere(5, 7);
    HashRng rng(5);
    for (const float scale : {1e-3f, 1.0f, 1e5f})
        for (const float distance : {0.0f, 1000.0f}) {
            const Vec3 centre = Vec3{0.7f, -0.4f, 0.59f} * (distance * scale);
            const Mesh mesh = scaled_and_moved(shape, scale, centre);
            const Bvh bvh = build_bvh(mesh);
            int leaks = 0;
            for (int i = 0; i < rays; ++i) {
                const TriangleCorners t = corners(mesh, rng.next_u32() % mesh.triangle_count());
                const Vec3 target = i % 3 == 0 ? t.a : lerp(t.a, t.b, rng.next_float());
                const Vec3 origin = centre + random_direction(rng) * (0.5f * scale * rng.next_float());
                const Ray ray{origin, normalize(target - origin)};
                leaks += !any_hit(bvh, ray) || !closest_hit(bvh, ray);
            }
            CHECK(leaks == 0);
        }
}

TEST_CASE("paths inside a closed mesh stay inside for ever, at any size and place") {
    // Each bounce starts on the surface: a position on the wrong side, or a gap, lets the path out. In corners the
    // margin off one wall can be beyond the other; there, and only there, a path may end.
    const int paths = k_sanitized ? 200 : 2000;
    const Mesh shape = bumpy_sphere(4, 8);
    HashRng rng(6);
    for (const float scale : {1e-3f, 1.0f, 1e5f}) {
        const Mesh mesh = scaled_and_moved(shape, scale, {});
        const Bvh bvh = build_bvh(mesh);
        int lost = 0, bounces = 0;
        for (int i = 0; i < paths; ++i) {
            Ray ray{random_direction(rng) * (0.5f * scale), random_direction(rng)};
            for (int bounce = 0; bounce < 20; ++bounce, ++bounces) {
                const auto hit = closest_hit(bvh, ray);
                if (!hit) {
                    ++lost;
                    break;
                }
                const SurfacePoint point = surface_point(mesh, *hit);
                const Vec3 inward = dot(point.geometric_normal, point.position) < 0 ? point.geometric_normal
                                                                                    : -point.geometric_normal;
                Vec3 direction = random_direction(rng);
                if (dot(direction, inward) < 0) direction = -direction;
                ray = spawn_ray(point, direction);
            }
        }
        CHECK(bounces > 19 * paths);
        CHECK(lost <= 1);
    }
}

TEST_CASE(
    "coincident faces cast no shadow on each other: a point on any of them sees what one face alone would "
    "see") {
    // Two boxes: one has each face once, the other three times, turned, flipped and with other diagonals.
    const auto add_box = [](Mesh& mesh, int variant) {
        const Vec3 x{variant == 1 ? -1.0f : 1.0f, 0, 0}, y{0, 1, 0}, z{0, 0, variant == 2 ? -1.0f : 1.0f};
        const Vec3 corner{variant == 1 ? 1.0f : 0.0f, 0, variant == 2 ? 1.0f : 0.0f};
        for (const Vec3 side : {Vec3{}, y}) add_quad(mesh, corner + side, x, z);
        for (const Vec3 side : {Vec3{}, x}) add_quad(mesh, corner + side, y, z);
        for (const Vec3 side : {Vec3{}, z}) add_quad(mesh, corner + side, x, y);
    };
    const Vec3 tilt_x = normalize(Vec3{0.8f, 0.1f, 0.3f}), tilt_y{-0.11f, 0.97f, 0.05f},
               tilt_z{0.2f, -0.3f, 0.9f};
    const auto tilt = [&](Mesh& mesh) {
        for (Vec3& p : mesh.positions)
            p = tilt_x * p.x + tilt_y * p.y + tilt_z * p.z + Vec3{0.3f, 0.2f, 0.1f};
    };
    Mesh once, thrice;
    add_box(once, 0);
    for (const int variant : {0, 1, 2}) add_box(thrice, variant);
    HashRng rng(7);
    for (const bool tilted : {false, true}) {
        if (tilted) {
            tilt(once);
            tilt(thrice);
        }
        const Bvh bvh_once = build_bvh(once), bvh_thrice = build_bvh(thrice);
        int differ = 0;
        for (int i = 0; i < 20000; ++i) {
            const Ray from_inside{thrice.positions[0] * 0.5f + thrice.positions[7] * 0.5f,
                                  random_direction(rng)};
            const auto hit = closest_hit(bvh_thrice, from_inside);
            if (!hit) continue;
            const Ray ray = spawn_ray(surface_point(thrice, *hit), random_direction(rng));
            if (std::abs(dot(ray.direction, surface_point(thrice, *hit).geometric_normal)) < 1e-5f) continue;
            differ += any_hit(bvh_thrice, ray) != any_hit(bvh_once, ray);
        }
        CHECK(differ == 0);
    }
}
