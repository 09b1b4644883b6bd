#include "pathscope/geometry/triangle.hpp"

#include "geometry/test_meshes.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

const TriangleCorners k_triangle{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}};

/// Number of triangles of the mesh that the ray hits.
int count_hits(const Mesh& mesh, const Ray& ray) {
    int hits = 0;
    for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i)
        hits += intersect_triangle(ray, corners(mesh, i)).has_value();
    return hits;
}

/// Distance along the ray by textbook algebra in long double, without regard to the triangle's edges.
long double plane_distance(const Ray& ray, const TriangleCorners& t) {
    using Real = long double;
    const Real p[3] = {Real(t.b.x) - t.a.x, Real(t.b.y) - t.a.y, Real(t.b.z) - t.a.z};
    const Real q[3] = {Real(t.c.x) - t.a.x, Real(t.c.y) - t.a.y, Real(t.c.z) - t.a.z};
    const Real n[3] = {p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]};
    Real distance = 0, speed = 0;
    for (int i = 0; i < 3; ++i) {
        distance += n[i] * (Real(t.a[i]) - ray.origin[i]);
        speed += n[i] * ray.direction[i];
    }
    return distance / speed;
}

}  // namespace

TEST_CASE("a hit that one can do on paper: t, u, v") {
    const Ray ray{{1, 2, 8}, {0, 0, -2}};
    const auto hit = intersect_triangle(ray, k_triangle);
    REQUIRE(hit);
    CHECK(hit->t == 4);
    CHECK(hit->u == 0.25f);
    CHECK(hit->v == 0.5f);
}

TEST_CASE("both sides count, and both ends of the interval") {
    CHECK(intersect_triangle({{1, 1, -3}, {0, 0, 1}}, k_triangle)->t == 3);
    CHECK(intersect_triangle({{1, 1, 3}, {0, 0, -1}, 3, 3}, k_triangle)->t == 3);
    CHECK_FALSE(intersect_triangle({{1, 1, 3}, {0, 0, -1}, 0, 2.9f}, k_triangle));
    CHECK_FALSE(intersect_triangle({{1, 1, 3}, {0, 0, -1}, 3.1f, 9}, k_triangle));
    CHECK_FALSE(intersect_triangle({{1, 1, 3}, {0, 0, 1}}, k_triangle));  // behind the origin
}

TEST_CASE("outside of each edge is a miss; on an edge or a corner is a hit") {
    const auto hits = [](float x, float y) {
        return intersect_triangle({{x, y, 1}, {0, 0, -1}}, k_triangle).has_value();
    };
    CHECK_FALSE(hits(-0x1p-20f, 1));
    CHECK_FALSE(hits(1, -0x1p-20f));
    CHECK_FALSE(hits(2 + 0x1p-20f, 2));
    CHECK(hits(0, 1));
    CHECK(hits(1, 0));
    CHECK(hits(2, 2));
    CHECK(hits(0, 0));
    CHECK(hits(4, 0));
    CHECK(hits(0, 4));
}

TEST_CASE("seen edge-on, a triangle is never hit") {
    CHECK_FALSE(intersect_triangle({{-1, 1, 0}, {1, 0, 0}}, k_triangle));
    CHECK_FALSE(intersect_triangle({{-1, -1, 0}, {1, 1, 0}}, k_triangle));
    CHECK_FALSE(intersect_triangle({{1, 1, 0}, {-1, 0.5f, 0}}, k_triangle));
}

TEST_CASE("a direction that is no direction hits nothing") {
    CHECK_FALSE(intersect_triangle({{1, 1, 1}, {0, 0, 0}}, k_triangle));
    CHECK_FALSE(intersect_triangle({{1, 1, 1}, {0, std::nanf(""), -1}}, k_triangle));
}

TEST_CASE("degenerate triangles are never hit, not even by rays aimed at them") {
    HashRng rng(1);
    int collinear = 0;
    for (int i = 0; i < 20000; ++i) {
        // Steps of 2^-10 keep the sums exact, so that the three points are on one line in real numbers.
        const Box grid{{-512, -512, -512}, {512, 512, 512}};
        const auto on_grid = [&] {
            const Vec3 p = random_point(rng, grid);
            return Vec3{std::round(p.x), std::round(p.y), std::round(p.z)} * 0x1p-10f;
        };
        const Vec3 a = on_grid(), step = on_grid();
        const TriangleCorners line{a, a + step, a + step * float(1 + i % 5)};
        const Vec3 origin = random_point(rng, {{-3, -3, -3}, {3, 3, 3}});
        const Vec3 target = line.at(rng.next_float(), 0);
        CHECK_FALSE(intersect_triangle({origin, target - origin}, line));
        CHECK_FALSE(intersect_triangle({origin, line.a - origin}, line));
        CHECK_FALSE(intersect_triangle({origin, line.a - origin}, {line.a, line.a, line.a}));
        collinear += is_degenerate(line);
    }
    CHECK(collinear == 20000);
}

TEST_CASE("scaling by a power of two changes t, u and v by nothing at all") {
    HashRng rng(2);
    int hits = 0;
    for (int i = 0; i < 2000; ++i) {
        const Box box{{-1, -1, -1}, {1, 1, 1}};
        const TriangleCorners t{random_point(rng, box), random_point(rng, box), random_point(rng, box)};
        const Ray ray{random_point(rng, box), random_direction(rng)};
        const auto hit = intersect_triangle(ray, t);
        for (const float scale : {0x1p-30f, 0x1p-10f, 0x1p17f, 0x1p40f}) {
            const auto scaled = intersect_triangle({ray.origin * scale, ray.direction * scale},
                                                   {t.a * scale, t.b * scale, t.c * scale});
            REQUIRE(scaled.has_value() == hit.has_value());
            if (!hit) continue;
            ++hits;
            CHECK((scaled->t == hit->t && scaled->u == hit->u && scaled->v == hit->v));
        }
    }
    CHECK(hits > 200);
}

TEST_CASE(
    "the surface is met no farther from where it is than the header says: 11.5 * 2^-24 of the distances") {
    HashRng rng(3);
    int hits = 0;
    for (int i = 0; i < 20000; ++i) {
        const Vec3 offset = i % 2 == 0 ? Vec3{} : Vec3{1000, -2000, 500};
        const Box box{offset + Vec3{-1, -1, -1}, offset + Vec3{1, 1, 1}};
        const TriangleCorners t{random_point(rng, box), random_point(rng, box), random_point(rng, box)};
        const Ray ray{random_point(rng, box), random_direction(rng)};
        const auto hit = intersect_triangle(ray, t);
        if (!hit) continue;
        ++hits;
        const float slope = std::abs(dot(geometric_normal(t), ray.direction));
        const long double exact = plane_distance(ray, t);
        const float distances =
            max_component(max(abs(t.a - ray.origin), max(abs(t.b - ray.origin), abs(t.c - ray.origin))));
        CHECK(std::abs(hit->t - exact) * slope <= 11.5L * 0x1p-24L * distances);
    }
    CHECK(hits > 500);
}

TEST_CASE("a closed surface has no gaps: rays from inside at its edges and corners always hit") {
    const Mesh shape = bumpy_sphere(3, 5);
    HashRng rng(4);
    int several = 0;
    for (const float scale : {1e-3f, 1.0f, 1e5f}) {
        for (const float distance : {0.0f, 1000.0f}) {
            CAPTURE(scale);
            CAPTURE(distance);
            const Mesh mesh = scaled_and_moved(shape, scale, Vec3{0.6f, -0.5f, 0.62f} * (distance * scale));
            const Vec3 centre = Vec3{0.6f, -0.5f, 0.62f} * (distance * scale);
            int gaps = 0;
            for (int i = 0; i < 3000; ++i) {
                const TriangleCorners t = corners(mesh, rng.next_u32() % mesh.triangle_count());
                const Vec3 target = i % 3 == 0 ? t.a : lerp(t.a, t.b, rng.next_float());
                const Vec3 origin = centre + random_direction(rng) * (0.3f * scale * rng.next_float());
                const int hits =
                    count_hits(mesh, {origin, i % 2 == 0 ? target - origin : normalize(target - origin)});
                gaps += hits == 0;
                several += hits > 1;
            }
            CHECK(gaps == 0);
        }
    }
    CHECK(several > 0);  // the rays did come close enough to edges for both neighbours to claim them
}

TEST_CASE("the sign of a difference of products is exact where rounded products are equal") {
    const double a = 1 + 0x1p-52, b = 1 - 0x1p-53;
    CHECK(a * b == 1.0);
    CHECK(difference_of_products(a, b, 1, 1) == 0x1p-53 - 0x1p-105);  // 2^-52 - 2^-53 - 2^-105
    CHECK(difference_of_products(1, 1, a, b) == -(0x1p-53 - 0x1p-105));
    CHECK(difference_of_products(3, 4, 6, 2) == 0);
    for (const double one : {1.0, -1.0})
        for (const double zero : {0.0, -0.0}) {
            const double difference = difference_of_products(one, zero, 1, 0.0);
            CHECK((difference == 0 && !std::signbit(difference)));
        }
}
