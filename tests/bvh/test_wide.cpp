#include <cmath>
#include <cstring>
#include <set>

#include "../../src/bvh/binary_tree.hpp"
#include "bvh/oracle.hpp"
#include "pathscope/bvh/wide_traverse.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// With every triangle that can be cut, cut.
constexpr WideBuildParams k_eager_cuts{.spatial_gain = 0, .extra_references = 4};
constexpr WideBuildParams k_no_cuts{.spatial_gain = 1};

std::vector<SimdLevel> levels() {
    std::vector<SimdLevel> levels;
    for (const auto& entry : k_simd_level_names)
        if (entry.value <= highest_simd_level()) levels.push_back(entry.value);
    return levels;
}

/// Long thin triangles in all directions: what spatial splits are for.
Mesh needles(int count, std::uint32_t seed) {
    HashRng rng(seed);
    Mesh mesh;
    for (int i = 0; i < count; ++i) {
        const Vec3 from = random_point(rng, {{0, 0, 0}, {1, 1, 1}});
        const Vec3 along = random_direction(rng) * rng.next_float();
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        for (const Vec3 corner : {from, from + along, from + along * 0.5f + random_direction(rng) * 0.02f})
            mesh.positions.push_back(corner);
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

Mesh wide_test_mesh(int number) { return number < 3 ? test_mesh(number) : needles(900, 4); }

bool same_bytes(const WideBvh& a, const WideBvh& b) {
    return a.nodes.size() == b.nodes.size() && a.blocks.size() == b.blocks.size() &&
           std::memcmp(a.nodes.data(), b.nodes.data(), a.nodes.size() * sizeof(WideNode)) == 0 &&
           std::memcmp(a.blocks.data(), b.blocks.data(), a.blocks.size() * sizeof(TriangleBlock)) == 0;
}

}  // namespace

TEST_CASE(
    "the wide tree's answers are brute force, bit for bit, with every instruction set and every build") {
    const int rays_per_mesh = k_sanitized ? 2000 : 25000;
    for (int number = 0; number < 4; ++number) {
        const Mesh mesh = wide_test_mesh(number);
        const WideBvh trees[] = {build_wide_bvh(mesh), build_wide_bvh(mesh, k_eager_cuts),
                                 build_wide_bvh(mesh, k_no_cuts)};
        RayMaker rays(mesh, 10 + static_cast<std::uint32_t>(number));
        int hits = 0, differ = 0;
        for (int i = 0; i < rays_per_mesh; ++i) {
            const Ray ray = rays.next();
            if (is_zero_direction(ray)) continue;
            const std::optional<Hit> expected = brute_force(mesh, ray);
            hits += expected.has_value();
            for (const SimdLevel level : levels())
                for (const WideBvh& tree : trees) {
                    differ += wide_kernel(level).closest_hit(tree, ray, {}) != expected;
                    differ += wide_kernel(level).any_hit(tree, ray, {}) != expected.has_value();
                }
        }
        CAPTURE(number);
        CHECK(differ == 0);
        CHECK(hits > rays_per_mesh / 20);
        CHECK(hits < rays_per_mesh);
    }
}

TEST_CASE("the same far from the origin of space, very small and very large") {
    for (int number = 0; number < 4; ++number)
        for (const float scale : {1e-12f, 1e-3f, 1e5f, 1e12f}) {
            const Mesh mesh =
                scaled_and_moved(wide_test_mesh(number), scale, Vec3{0.7f, -0.4f, 0.59f} * (1000 * scale));
            const WideBvh bvh = build_wide_bvh(mesh, k_eager_cuts);
            RayMaker rays(mesh, 20 + static_cast<std::uint32_t>(number));
            int differ = 0;
            for (int i = 0; i < 2000; ++i) {
                const Ray ray = rays.next();
                if (is_zero_direction(ray)) continue;
                const std::optional<Hit> expected = brute_force(mesh, ray);
                for (const SimdLevel level : levels()) {
                    differ += wide_kernel(level).closest_hit(bvh, ray, {}) != expected;
                    differ += wide_kernel(level).any_hit(bvh, ray, {}) != expected.has_value();
                }
            }
            CAPTURE(number);
            CAPTURE(scale);
            CHECK(differ == 0);
        }
}

TEST_CASE("the filter is honoured: holes are seen through") {
    const auto checkered = [](std::uint32_t triangle, float u, float v) {
        return (static_cast<int>(u * 4) + static_cast<int>(v * 4) + static_cast<int>(triangle)) % 2 == 0;
    };
    for (int number = 0; number < 4; ++number) {
        const Mesh mesh = wide_test_mesh(number);
        const WideBvh bvh = build_wide_bvh(mesh);
        RayMaker rays(mesh, 30 + static_cast<std::uint32_t>(number));
        int differ = 0, seen_through = 0;
        for (int i = 0; i < 3000; ++i) {
            const Ray ray = rays.next();
            if (is_zero_direction(ray)) continue;
            const std::optional<Hit> expected = brute_force(mesh, ray, checkered);
            for (const SimdLevel level : levels()) {
                differ += wide_kernel(level).closest_hit(bvh, ray, hit_filter(checkered)) != expected;
                differ += wide_kernel(level).any_hit(bvh, ray, hit_filter(checkered)) != expected.has_value();
            }
            seen_through += closest_hit(bvh, ray) != expected;
        }
        CHECK(differ == 0);
        CHECK(seen_through > 50);
    }
}

TEST_CASE("rays in packets find what they find alone, bit for bit, coherent or not") {
    HashRng rng(21);
    for (int number = 0; number < 4; ++number) {
        const Mesh mesh = wide_test_mesh(number);
        const WideBvh bvh = build_wide_bvh(mesh);
        RayMaker odd_rays(mesh, 40 + static_cast<std::uint32_t>(number));
        const auto every_other = [](std::uint32_t triangle, float, float) { return triangle % 2 == 0; };
        int differ = 0, hits = 0;
        for (int i = 0; i < (k_sanitized ? 300 : 3000); ++i) {
            // A bundle of rays with a common origin or nearby ones, a bundle around an axis, or anything at all.
            const Vec3 from = random_point(rng, {{-1, -1, -1}, {2, 2, 2}});
            const Vec3 axis = i % 3 == 1 ? Vec3{0, 1, 0} : normalize(random_point(rng, bounds(mesh)) - from);
            std::vector<Ray> rays;
            const std::size_t count = i % 5 == 0 ? 1 + rng.next_u32() % k_packet_rays : k_packet_rays;
            while (rays.size() < count) {
                const Vec3 origin = i % 2 == 0 ? from : from + random_direction(rng) * 0.01f;
                Ray ray{origin, normalize(axis + random_direction(rng) * 0.02f)};
                if (i % 7 == 0) ray = odd_rays.next();
                if (i % 4 == 0) ray.t_max = 2 * rng.next_float();
                if (!is_zero_direction(ray)) rays.push_back(ray);
            }
            for (const SimdLevel level : levels())
                for (const HitFilter filter : {HitFilter{}, hit_filter(every_other)}) {
                    std::array<std::optional<Hit>, k_packet_rays> closest;
                    wide_kernel(level).closest_hit_packet(bvh, rays, filter, std::span(closest).first(count));
                    const std::uint32_t any = wide_kernel(level).any_hit_packet(bvh, rays, filter);
                    for (std::size_t k = 0; k < count; ++k) {
                        const auto expected =
                            wide_kernel(SimdLevel::portable).closest_hit(bvh, rays[k], filter);
                        hits += expected.has_value();
                        differ += closest[k] != expected;
                        differ += (any >> k & 1) != expected.has_value();
                    }
                }
        }
        CAPTURE(number);
        CHECK(differ == 0);
        CHECK(hits > 1000);
    }
}

TEST_CASE("a ray along an axis opens no more nodes than one beside it") {
    const Mesh mesh = random_soup(5000, 24);
    const WideBvh bvh = build_wide_bvh(mesh);
    for (const SimdLevel level : levels()) {
        TraversalCounts along, beside;
        HashRng rng(25);
        for (int i = 0; i < 1000; ++i) {
            const Vec3 from = random_point(rng, {{-1, -1, 5}, {2, 2, 6}});
            (void)wide_kernel(level).count_closest_hit(bvh, {from, {0, 0, -1}}, {}, along);
            (void)wide_kernel(level).count_closest_hit(bvh, {from, {1e-6f, -1e-6f, -1}}, {}, beside);
        }
        CHECK(double(along.nodes) < 1.01 * double(beside.nodes));
        CHECK(beside.nodes > 1000);
    }
}

TEST_CASE(
    "of walls one behind the other, however many, those before the first hit are opened, and no other") {
    HashRng rng(28);
    for (const int walls : {1, 2, 3, 6}) {
        Mesh mesh;
        for (int i = 1; i <= walls; ++i) add_quad(mesh, {-1, -1, float(2 * i)}, {2, 0, 0}, {0, 2, 0}, 2);
        for (const float end :
             {0.0f, float(2 * walls + 2)}) {  // A triangle that rays pass by, though in its box.
            const auto first = std::uint32_t(mesh.positions.size());
            for (const Vec3 corner : {Vec3{-1, -1, end}, Vec3{1, -1, end}, Vec3{-1, 1, end}})
                mesh.positions.push_back(corner);
            mesh.triangles.push_back({first, first + 1, first + 2});
        }
        const WideBvh bvh = build_wide_bvh(mesh);
        for (const SimdLevel level : levels())
            for (const bool forward : {true, false}) {
                TraversalCounts counts;
                const float z = forward ? -1.0f : float(2 * walls + 3);
                const Ray ray{random_point(rng, {{0.3f, 0.3f, z}, {0.7f, 0.7f, z}}),
                              {0, 0, forward ? 1.0f : -1.0f}};
                REQUIRE(wide_kernel(level).count_closest_hit(bvh, ray, {}, counts));
                CHECK(counts.nodes == 3);  // The root, the triangle, a wall.
            }
    }
}

TEST_CASE("who looks for any hit looks where much surface costs little, before a larger box") {
    // A wall of two triangles, and behind it many small ones in larger boxes.
    HashRng rng(26);
    Mesh mesh = scaled_and_moved(bumpy_sphere(4, 27), 2, {0, 0, 4});
    add_quad(mesh, {-1, -1, 1}, {2, 0, 0}, {0, 2, 0});
    const WideBvh bvh = build_wide_bvh(mesh);
    for (const SimdLevel level : levels()) {
        TraversalCounts counts;
        for (int i = 0; i < 1000; ++i) {
            const Vec3 through = random_point(rng, {{-0.9f, -0.9f, 1}, {0.9f, 0.9f, 1}});
            const Vec3 from = random_point(rng, {{-1, -1, -1}, {1, 1, 0}});
            REQUIRE(wide_kernel(level).count_any_hit(bvh, {from, through - from}, {}, counts));
        }
        CHECK(counts.nodes < 3.5 * 1000);  // The root, a node, the wall; largest box first would take 4.8.
    }
}

TEST_CASE("packets lose no hit at corners and edges, near or far, large or small") {
    // Where the estimate in floats that goes before the test can be wrong.
    HashRng rng(22);
    for (const float scale : {1e-6f, 1.0f, 1e6f})
        for (const Vec3 shift : {Vec3{}, Vec3{300, -100, 2000}}) {
            Mesh mesh = random_soup(500, 23);
            for (Vec3& position : mesh.positions) position = (position + shift) * scale;
            const WideBvh bvh = build_wide_bvh(mesh);
            int differ = 0, hits = 0;
            for (int i = 0; i < (k_sanitized ? 100 : 1000); ++i) {
                const Vec3 from = (random_point(rng, {{-3, -3, -3}, {3, 3, 3}}) + shift) * scale;
                std::vector<Ray> rays;
                while (rays.size() <
                       k_packet_rays) {  // At a corner of one triangle, or at the middle of an edge.
                    const TriangleCorners aim = corners(mesh, rng.next_u32() % mesh.triangle_count());
                    const Vec3 target = rng.next_u32() % 2 == 0 ? aim.a : aim.b + (aim.c - aim.b) * 0.5f;
                    const Vec3 origin = i % 2 == 0 ? from : from + random_direction(rng) * (0.1f * scale);
                    rays.push_back({origin, normalize(target - origin)});
                }
                for (const SimdLevel level : levels()) {
                    std::array<std::optional<Hit>, k_packet_rays> closest;
                    wide_kernel(level).closest_hit_packet(bvh, rays, {}, closest);
                    for (std::size_t k = 0; k < k_packet_rays; ++k) {
                        const auto expected = wide_kernel(SimdLevel::portable).closest_hit(bvh, rays[k], {});
                        hits += expected.has_value();
                        differ += closest[k] != expected;
                    }
                }
            }
            CAPTURE(scale);
            CHECK(differ == 0);
            CHECK(hits > 1000);
        }
}

TEST_CASE("the tree is the same, byte for byte, for any number of threads") {
    const Mesh mesh = needles(20000, 8);  // More than one subtree.
    const WideBvh one = build_wide_bvh(mesh, {}, 1);
    CHECK(same_bytes(one, build_wide_bvh(mesh, {}, 2)));
    CHECK(same_bytes(one, build_wide_bvh(mesh, {}, 5)));
}

TEST_CASE("every triangle is in a block, each block is reached once, and cuts pay") {
    const Mesh mesh = needles(3000, 9);
    const auto check = [&](const WideBuildParams& params) {
        const WideBvh bvh = build_wide_bvh(mesh, params);
        std::set<std::uint32_t> triangles, blocks;
        std::size_t children = 0;
        for (const WideNode& node : bvh.nodes)
            for (std::size_t i = 0; i < k_wide; ++i)
                if (node.bounds[0][i] <= node.bounds[3][i]) {
                    ++children;
                    if (node.children[i] & k_leaf_child) blocks.insert(node.children[i] & ~k_leaf_child);
                }
        for (const TriangleBlock& block : bvh.blocks)
            for (std::size_t lane = 0; lane < k_wide; ++lane)
                if (!std::isnan(block.corners[0][0][lane])) triangles.insert(block.triangles[lane]);
        CHECK(triangles.size() == 3000);
        CHECK(blocks.size() == bvh.blocks.size());
        CHECK(children == bvh.nodes.size() - 1 + bvh.blocks.size());
        return wide_bvh_stats(bvh, params);
    };
    const WideBvhStats cut = check({}), whole = check(k_no_cuts);
    CHECK(whole.references == 3000);
    CHECK(cut.references > 3000);
    CHECK(cut.references <= 4500);  // extra_references
    CHECK(cut.cost < whole.cost);
}

TEST_CASE("no other choice of eight children is cheaper: all of them, for small trees") {
    // Brute force over every way to open children, on trees of few leaves, where it can be afforded.
    struct Search {
        const BinaryTree& tree;
        double best(std::uint32_t number, std::size_t places) const {  // A forest of `places` trees at most.
            const BinaryNode& node = tree.nodes[number];
            double least = single(number);
            if (!node.is_leaf())
                for (std::size_t i = 1; i < places; ++i)
                    least = std::min(least, best(node.left, i) + best(node.left + 1, places - i));
            return least;
        }
        double single(std::uint32_t number) const {
            const BinaryNode& node = tree.nodes[number];
            const double area = node.box.half_area();
            double least = node.count <= k_wide ? area : 1e30;
            if (!node.is_leaf())
                for (std::size_t i = 1; i < k_wide; ++i)
                    least = std::min(least, area + best(node.left, i) + best(node.left + 1, k_wide - i));
            return least;
        }
    };
    for (std::uint32_t seed = 1; seed <= 5; ++seed) {
        const Mesh mesh = random_soup(24, seed);
        const BinaryTree tree = build_binary_tree(mesh, k_no_cuts, 1);
        const WideBvhStats stats = wide_bvh_stats(collapse(tree, mesh, k_no_cuts), k_no_cuts);
        const double expected = Search{tree}.single(0) / tree.nodes[0].box.half_area();
        CHECK(stats.cost == doctest::Approx(expected).epsilon(1e-5));
    }
}
