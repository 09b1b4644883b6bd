#include <algorithm>
#include <set>

#include "bvh/oracle.hpp"
#include "pathscope/bvh/occluder_cache.hpp"
#include "pathscope/bvh/tree.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

TEST_CASE("whatever a cache of occluders holds, the answers are those without it") {
    const auto every_other = [](std::uint32_t triangle, float, float) { return triangle % 2 == 0; };
    for (int number = 0; number < 3; ++number) {
        const Mesh mesh = test_mesh(number);
        const WideBvh bvh = build_wide_bvh(mesh);
        RayMaker rays(mesh, 60 + static_cast<std::uint32_t>(number));
        OccluderCache all, half;
        int differ = 0, hits = 0;
        for (int i = 0; i < (k_sanitized ? 2000 : 20000); ++i) {
            const Ray ray = rays.next();
            if (ray.direction == Vec3{}) continue;
            const bool expected = any_hit(bvh, ray);
            hits += expected;
            differ += any_hit(bvh, ray, AcceptAll{}, all) != expected;
            differ += any_hit(bvh, ray, every_other, half) != any_hit(bvh, ray, every_other);
        }
        CAPTURE(number);
        CHECK(differ == 0);
        CHECK(hits > 500);
    }
}

TEST_CASE(
    "a cache of occluders holds what stopped the last ray that went this way, at each level of "
    "instructions") {
    const Mesh mesh = test_mesh(0);
    const WideBvh bvh = build_wide_bvh(mesh);
    const Box box = bounds(mesh);
    HashRng rng(61);
    for (const auto& level : k_simd_level_names) {
        if (level.value > highest_simd_level()) continue;
        int stopped = 0;
        for (int i = 0; i < 1000; ++i) {
            const Ray ray{random_point(rng, box), random_direction(rng)};
            std::uint32_t occluder = k_no_occluder;
            const bool hit = wide_kernel(level.value).any_hit_from(bvh, ray, {}, occluder);
            CHECK(hit == (occluder != k_no_occluder));
            if (!hit) continue;
            ++stopped;
            const TriangleBlock& block = bvh.blocks[occluder];
            const auto meets = [&](std::uint32_t triangle) {
                return intersect_triangle(ray, corners(mesh, triangle)).has_value();
            };
            CHECK(std::any_of(block.triangles.begin(), block.triangles.end(), meets));
            // A ray that nothing stops empties the place.
            CHECK_FALSE(wide_kernel(level.value).any_hit_from(bvh, {box.high * 3, {1, 1, 1}}, {}, occluder));
            CHECK(occluder == k_no_occluder);
        }
        CHECK(stopped > 50);
    }
}

TEST_CASE("neighbouring directions share a cell, and every direction has one") {
    OccluderCache cache;
    HashRng rng(62);
    std::uint32_t* const cell = &cache.towards({0.3f, 0.5f, -0.7f});
    CHECK(cell == &cache.towards({0.31f, 0.5f, -0.7f}));
    CHECK(cell == &cache.towards({30, 50, -70}));
    CHECK(cell != &cache.towards({0.3f, 0.5f, 0.7f}));
    CHECK(cell != &cache.towards({-0.3f, 0.5f, -0.7f}));
    for (const Vec3 direction :
         {Vec3{1, 0, 0}, Vec3{-1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, -1, -0.0f}, Vec3{0, 0, -1}})
        CHECK(cache.towards(direction) == k_no_occluder);
    std::set<const std::uint32_t*> cells;
    for (int i = 0; i < 10000; ++i) cells.insert(&cache.towards(random_direction(rng)));
    // Two diamonds in squares of 64 cells: some corners are never seen.
    CHECK(cells.size() > 64);
    CHECK(cells.size() <= 128);
}
