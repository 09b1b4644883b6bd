#include "pathscope/geometry/sphere.hpp"

#include "geometry/test_meshes.hpp"
#include "pathscope/geometry/spawn.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

TEST_CASE("a sphere from outside, from inside, behind, and past it") {
    const Vec3 centre{0, 0, 10};
    const auto outside = intersect_sphere({{0, 0, 0}, {0, 0, 1}}, centre, 2);
    REQUIRE(outside);
    CHECK(outside->t == 8);
    CHECK(outside->position == Vec3{0, 0, 8});
    CHECK(outside->normal == Vec3{0, 0, -1});
    CHECK(intersect_sphere({{0, 0, 10}, {0, 0, 2}}, centre, 2)->t == 1);  // direction of length 2
    CHECK_FALSE(intersect_sphere({{0, 0, 13}, {0, 0, 1}}, centre, 2));
    CHECK_FALSE(intersect_sphere({{2.001f, 0, 0}, {0, 0, 1}}, centre, 2));
    CHECK(intersect_sphere({{1.999f, 0, 0}, {0, 0, 1}}, centre, 2));
}

TEST_CASE("the interval of the ray picks the hit") {
    const Vec3 centre{0, 0, 10};
    CHECK(intersect_sphere({{0, 0, 0}, {0, 0, 1}, 9, 20}, centre, 2)->t == 12);
    CHECK(intersect_sphere({{0, 0, 0}, {0, 0, 1}, 8, 8}, centre, 2)->t == 8);
    CHECK_FALSE(intersect_sphere({{0, 0, 0}, {0, 0, 1}, 0, 7.9f}, centre, 2));
    CHECK_FALSE(intersect_sphere({{0, 0, 0}, {0, 0, 1}, 9, 11}, centre, 2));
}

TEST_CASE("a small sphere far away keeps its shape") {
    // The school formula in float sees b^2 = 1e12 and loses the radius altogether.
    HashRng rng(1);
    for (int i = 0; i < 1000; ++i) {
        const Vec3 target = Vec3{1e6f, 2e6f, -5e5f} + random_direction(rng) * 0.5f;
        const auto hit = intersect_sphere({{0, 0, 0}, target}, {1e6f, 2e6f, -5e5f}, 1);
        REQUIRE(hit);
        CHECK(hit->t == doctest::Approx(1).epsilon(2e-6));
    }
}

TEST_CASE("the stated error covers the distance from the sphere, at any size and place") {
    HashRng rng(2);
    for (const float scale : {1e-3f, 1.0f, 1e5f})
        for (const float distance : {0.0f, 1000.0f}) {
            const Vec3 centre = Vec3{0.7f, -0.4f, 0.59f} * (distance * scale);
            for (int i = 0; i < 2000; ++i) {
                const Ray ray{centre + random_direction(rng) * (2 * scale), random_direction(rng)};
                const auto hit = intersect_sphere(ray, centre, scale);
                if (!hit) continue;
                long double squared = 0;
                for (int axis = 0; axis < 3; ++axis) {
                    const long double d = (long double)(hit->position[axis]) - centre[axis];
                    squared += d * d;
                }
                const auto off = static_cast<float>(std::abs(std::sqrt(squared) - scale));
                CHECK(off <= length(hit->position_error));
            }
        }
}

TEST_CASE("a ray that leaves a sphere outwards never hits it; one that enters hits its far side") {
    HashRng rng(3);
    for (const float scale : {1e-3f, 1.0f, 1e5f})
        for (const float distance : {0.0f, 1000.0f}) {
            const Vec3 centre = Vec3{0.7f, -0.4f, 0.59f} * (distance * scale);
            int tested = 0;
            for (int i = 0; i < 5000; ++i) {
                const Ray aimed{centre + random_direction(rng) * (3 * scale), random_direction(rng)};
                const auto hit = intersect_sphere(
                    {aimed.origin, centre - aimed.origin + random_direction(rng) * scale * 0.9f}, centre,
                    scale);
                if (!hit) continue;
                const Vec3 direction = random_direction(rng);
                const float cosine = dot(direction, hit->normal);
                if (std::abs(cosine) < 1e-3f)
                    continue;  // far from the origin the sphere is a polyhedron of floats
                ++tested;
                const Vec3 origin = offset_origin(hit->position, hit->position_error, hit->normal, direction);
                const auto again = intersect_sphere({origin, direction}, centre, scale);
                CHECK(again.has_value() == (cosine < 0));
                if (again) CHECK(std::abs(again->t + 2 * cosine * scale) < 0.05f * scale);
            }
            CHECK(tested > 3000);
        }
}
