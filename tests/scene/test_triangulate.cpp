#include <array>
#include <cmath>
#include <set>
#include <vector>

#include "pathscope/math/frame.hpp"
#include "pathscope/math/random.hpp"
#include "pathscope/scene/triangulate.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

using Polygon = std::vector<Vec3>;

std::vector<std::uint32_t> cut(const Polygon& polygon) {
    std::vector<std::uint32_t> triangles;
    triangulate(polygon, triangles);
    return triangles;
}

double size(const PolygonNormal& n) { return std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z); }
double area(const Polygon& polygon) { return size(polygon_normal(polygon)) / 2; }

/// Sum of the triangles' areas, each taken positive; equal to the polygon's area only if none overlaps.
double area_of_triangles(const Polygon& polygon) {
    double sum = 0;
    const auto triangles = cut(polygon);
    for (std::size_t i = 0; i < triangles.size(); i += 3)
        sum += area({polygon[triangles[i]], polygon[triangles[i + 1]], polygon[triangles[i + 2]]});
    return sum;
}

/// Every corner at its own radius around the origin: simple, and far from convex.
Polygon star(HashRng& rng, int corners, Vec3 normal, Vec3 centre) {
    const Frame frame = Frame::around(normal);
    Polygon polygon;
    for (int i = 0; i < corners; ++i) {
        const float angle = 2 * k_pi * float(i) / float(corners), radius = 0.1f + rng.next_float();
        polygon.push_back(centre + frame.to_world({radius * std::cos(angle), radius * std::sin(angle), 0}));
    }
    return polygon;
}

Vec3 any_direction(HashRng& rng) {
    for (;;) {
        const Vec3 v{2 * rng.next_float() - 1, 2 * rng.next_float() - 1, 2 * rng.next_float() - 1};
        if (length_squared(v) < 1 && length_squared(v) > 0.01f) return normalize(v);
    }
}

void check_partition(const Polygon& polygon) {
    const auto triangles = cut(polygon);
    CHECK(triangles.size() == 3 * (polygon.size() - 2));
    CHECK(area_of_triangles(polygon) == doctest::Approx(area(polygon)).epsilon(1e-5));
    // Each triangle turns as the polygon does.
    const PolygonNormal normal = polygon_normal(polygon);
    for (std::size_t i = 0; i + 2 < triangles.size(); i += 3) {
        const PolygonNormal n = polygon_normal(
            Polygon{polygon[triangles[i]], polygon[triangles[i + 1]], polygon[triangles[i + 2]]});
        CHECK(n.x * normal.x + n.y * normal.y + n.z * normal.z >= -1e-9 * size(normal) * size(normal));
    }
}

}  // namespace

TEST_CASE("a quad is cut along its shorter diagonal, unless that lies outside") {
    CHECK(cut({{0, 0, 0}, {3, 0, 0}, {4, 1, 0}, {1, 1, 0}}) == std::vector<std::uint32_t>{0, 1, 3, 1, 2, 3});
    CHECK(cut({{0, 0, 0}, {3, 0, 0}, {2, 1, 0}, {-1, 1, 0}}) == std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3});
    // An arrow head: the shorter diagonal 1-3 lies outside, since corner 2 turns right.
    const Polygon arrow{{0, 0, 0}, {1, 5, 0}, {0, 4, 0}, {-1, 5, 0}};
    CHECK(area_of_triangles(arrow) == doctest::Approx(area(arrow)));
    const Polygon turned_arrow{{1, 5, 0}, {0, 4, 0}, {-1, 5, 0}, {0, 0, 0}};
    CHECK(area_of_triangles(turned_arrow) == doctest::Approx(area(turned_arrow)));
}

TEST_CASE("the triangles of a polygon that is not convex add up to it, in any plane and place") {
    check_partition({{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {3, 4, 0}, {3, 1, 0}, {1, 1, 0}, {1, 4, 0}, {0, 4, 0}});
    HashRng rng(1);
    for (int i = 0; i < 200; ++i) {
        const Vec3 centre = any_direction(rng) * 10.0f;
        check_partition(star(rng, 5 + i % 60, any_direction(rng), centre));
    }
    for (const Vec3 axis : {Vec3{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}})
        check_partition(star(rng, 30, axis, {}));
}

TEST_CASE("corners on one line and corners met twice are no obstacle") {
    check_partition({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {2, 2, 0}, {1, 2, 0}, {0, 2, 0}, {0, 1, 0}});
    // A frame: the outer square and the hole, joined by a bridge that is walked twice.
    check_partition({{0, 0, 0},
                     {3, 0, 0},
                     {3, 3, 0},
                     {0, 3, 0},
                     {0, 0, 0},
                     {1, 1, 0},
                     {1, 2, 0},
                     {2, 2, 0},
                     {2, 1, 0},
                     {1, 1, 0}});
}

TEST_CASE("polygons without area, and such that cross themselves, still end") {
    HashRng rng(2);
    for (std::size_t corners = 4; corners < 12; ++corners) {
        CHECK(cut(Polygon(corners, Vec3{1, 2, 3})).size() == 3 * (corners - 2));
        Polygon line;
        for (std::size_t i = 0; i < corners; ++i) line.push_back({float(i * 7 % 5), 0, 0});
        CHECK(cut(line).size() == 3 * (corners - 2));
        Polygon knot;
        for (std::size_t i = 0; i < corners; ++i) knot.push_back(any_direction(rng));
        CHECK(cut(knot).size() == 3 * (corners - 2));
    }
}

TEST_CASE("every corner of a convex polygon is used, and no triangle twice") {
    Polygon circle;
    for (int i = 0; i < 1000; ++i)
        circle.push_back({std::cos(2 * k_pi * float(i) / 1000), std::sin(2 * k_pi * float(i) / 1000), 0});
    const auto triangles = cut(circle);
    CHECK(std::set<std::uint32_t>(triangles.begin(), triangles.end()).size() == 1000);
    CHECK(area_of_triangles(circle) == doctest::Approx(area(circle)).epsilon(1e-6));
}
