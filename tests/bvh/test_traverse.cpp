#include "pathscope/bvh/traverse.hpp"

#include <array>

#include "geometry/test_meshes.hpp"
#include "pathscope/geometry/spawn.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// The definition: all triangles one by one; the smallest t, and of equal ones the lowest number.
template <class Accept = AcceptAll>
std::optional<Hit> brute_force(const Mesh& mesh, const Ray& ray, Accept&& accept = {}) {
    const TriangleRay triangle_ray(ray);
    std::optional<Hit> best;
    for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
        const TriangleCorners t = corners(mesh, i);
        const auto hit =
            intersect_triangle(triangle_ray, as_corner(t.a), as_corner(t.b), as_corner(t.c), ray.t_max);
        if (!hit || (best && hit->t >= best->t) || !accept(i, hit->u, hit->v)) continue;
        best = Hit{hit->t, hit->u, hit->v, i};
    }
    return best;
}

/// Rays of all kinds that have broken traversals: free, along axes (with zeros of both signs), in planes of axes, from
/// surfaces without an offset, through points of edges and through vertices.
class RayMaker {
  public:
    RayMaker(const Mesh& mesh, std::uint32_t seed) : mesh_(mesh), rng_(seed), scene_(bounds(mesh)) {
        const Vec3 margin = scene_.extent() * 0.25f;
        around_ = {scene_.low - margin, scene_.high + margin};
    }

    Ray next() {
        Ray ray = of_kind(kind_++ % 8);
        if (rng_.next_float() < 0.2f) limit(ray);
        return ray;
    }

  private:
    TriangleCorners some_triangle() { return corners(mesh_, rng_.next_u32() % mesh_.triangle_count()); }
    float sign() { return rng_.next_float() < 0.5f ? -1.0f : 1.0f; }
    Vec3 along_axis() {
        Vec3 direction{0.0f * sign(), 0.0f * sign(), 0.0f * sign()};
        direction[static_cast<int>(rng_.next_u32() % 3)] = sign();
        return direction;
    }
    Vec3 on_surface() { return some_triangle().at(rng_.next_float() * 0.5f, rng_.next_float() * 0.5f); }
    Ray towards(Vec3 target) {
        const Vec3 origin = random_point(rng_, around_);
        const Vec3 direction = target - origin;
        return {origin, rng_.next_float() < 0.5f && length(direction) > 0 ? normalize(direction) : direction};
    }

    Ray of_kind(int kind) {
        if (kind == 0) return {random_point(rng_, around_), random_direction(rng_)};
        if (kind == 1) return {random_point(rng_, around_), along_axis()};
        if (kind == 2) return {some_triangle().a, along_axis()};
        if (kind == 3) return {on_surface(), random_direction(rng_)};
        if (kind == 4) return towards(some_triangle().b);
        if (kind == 5) {
            const TriangleCorners t = some_triangle();
            return towards(lerp(t.a, t.b, rng_.next_float()));
        }
        if (kind == 6) {  // within a plane of two axes
            Ray ray{on_surface(), random_direction(rng_)};
            ray.direction[static_cast<int>(rng_.next_u32() % 3)] = 0.0f * sign();
            return ray;
        }
        return {some_triangle().a, some_triangle().b - some_triangle().c};  // from a vertex, along some edge
    }

    /// The interval begins or ends at a hit, or just beside one, or anywhere.
    void limit(Ray& ray) {
        const auto hit = brute_force(mesh_, ray);
        const float t = hit ? hit->t : length(scene_.extent());
        const int how = static_cast<int>(rng_.next_u32() % 5);
        if (how == 0) ray.t_max = t;
        if (how == 1) ray.t_max = std::nextafter(t, 0.0f);
        if (how == 2) ray.t_min = t;
        if (how == 3) ray.t_min = std::nextafter(t, k_infinity);
        if (how == 4) ray.t_max = t * 2 * rng_.next_float();
    }

    const Mesh& mesh_;
    HashRng rng_;
    Box scene_, around_;
    int kind_ = 0;
};

Mesh test_mesh(int number) {
    if (number == 0) return random_soup(700, 1);
    if (number == 1) return bumpy_sphere(3, 2);
    return box_interior(8);
}

bool is_zero_direction(const Ray& ray) { return is_zero(ray.direction); }

}  // namespace

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

TEST_CASE("of coincident triangles the lowest number counts, whatever the tree") {
    Mesh mesh;
    for (int i = 0; i < 40; ++i) add_quad(mesh, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    for (const BvhSplit split : {BvhSplit::sah, BvhSplit::median}) {
        const Bvh bvh = build_bvh(mesh, {.split = split, .max_leaf_triangles = 1});
        CHECK(closest_hit(bvh, {{0.7f, 0.2f, 1}, {0, 0, -1}})->triangle == 0);
        CHECK(closest_hit(bvh, {{0.2f, 0.7f, 1}, {0, 0, -1}})->triangle == 1);
        CHECK(closest_hit(bvh, {{0.5f, 0.5f, 1}, {0, 0, -1}})->triangle == 0);  // on the diagonal: both
        const auto not_the_first = [](std::uint32_t triangle, float, float) { return triangle > 4; };
        CHECK(closest_hit(bvh, {{0.7f, 0.2f, 1}, {0, 0, -1}}, not_the_first)->triangle == 6);
    }
}

TEST_CASE("an empty mesh, an empty interval, and directions that are none meet nothing") {
    const Bvh empty = build_bvh(Mesh{});
    CHECK_FALSE(closest_hit(empty, {{0, 0, 0}, {0, 0, 1}}));
    CHECK_FALSE(any_hit(empty, {{0, 0, 0}, {0, 0, 1}}));

    const Bvh sphere = build_bvh(bumpy_sphere(3, 2));
    CHECK(any_hit(sphere, {{0, 0, 0}, {0, 0, 1}}));
    CHECK_FALSE(any_hit(sphere, {{0, 0, 0}, {0, 0, 1}, 0, -1}));
    CHECK_FALSE(closest_hit(sphere, {{0, 0, 0}, {0, 0, 1}, 0, -1}));
    CHECK_FALSE(any_hit(sphere, {{0, 0, 0}, {0, 0, 0}}));
    CHECK_FALSE(any_hit(sphere, {{0, 0, 0}, {0, std::nanf(""), 1}}));
    CHECK_FALSE(closest_hit(sphere, {{std::nanf(""), 0, 0}, {0, 0, 1}}));
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
