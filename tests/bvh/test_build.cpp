#include <cstring>
#include <set>

#include "geometry/test_meshes.hpp"
#include "pathscope/bvh/bvh.hpp"
#include "pathscope/bvh/traverse.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

bool contains(const Box& outer, const Box& inner) {
    return min(outer.low, inner.low) == outer.low && max(outer.high, inner.high) == outer.high;
}

/// What a walk over the whole tree finds.
struct Census {
    std::multiset<std::uint32_t> triangles;
    std::uint32_t nodes = 0, leaves = 0, largest_leaf = 0;
    int depth = 0;
    bool boxes_nest = true;
};

void count_subtree(Census& census, const Bvh& bvh, const Mesh& mesh, std::uint32_t number, int depth) {
    const BvhNode& node = bvh.node(number);
    ++census.nodes;
    census.depth = std::max(census.depth, depth);
    if (node.is_leaf()) {
        ++census.leaves;
        census.largest_leaf = std::max(census.largest_leaf, node.count);
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
            const LeafTriangle& leaf = bvh.triangles[i];
            const TriangleCorners t = corners(mesh, leaf.triangle);
            census.triangles.insert(leaf.triangle);
            census.boxes_nest &= contains(node.box(), bounds(t));
            census.boxes_nest &=
                leaf.a == as_corner(t.a) && leaf.b == as_corner(t.b) && leaf.c == as_corner(t.c);
        }
        return;
    }
    for (const std::uint32_t child : {node.first, node.first + 1}) {
        census.boxes_nest &= contains(node.box(), bvh.node(child).box());
        count_subtree(census, bvh, mesh, child, depth + 1);
    }
}

Census count_tree(const Bvh& bvh, const Mesh& mesh) {
    Census census;
    if (!bvh.empty()) count_subtree(census, bvh, mesh, 0, 0);
    return census;
}

std::multiset<std::uint32_t> triangles_with_area(const Mesh& mesh) {
    std::multiset<std::uint32_t> numbers;
    for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i)
        if (!is_degenerate(corners(mesh, i))) numbers.insert(i);
    return numbers;
}

void check_sound(const Mesh& mesh, const BvhBuildParams& params = {}) {
    const Bvh bvh = build_bvh(mesh, params);
    const Census census = count_tree(bvh, mesh);
    CHECK(census.triangles == triangles_with_area(mesh));
    CHECK(census.boxes_nest);
    CHECK(census.largest_leaf <= static_cast<std::uint32_t>(params.max_leaf_triangles));
    CHECK(census.depth <= params.max_depth);

    const BvhStats stats = bvh_stats(bvh, params);
    CHECK(stats.triangles == census.triangles.size());
    CHECK(stats.nodes == census.nodes);
    CHECK(stats.leaves == census.leaves);
    CHECK(stats.depth == census.depth);
    CHECK(stats.nodes == 2 * stats.leaves - 1);
}

/// Each triangle is `ratio` times as far from the origin as the one before, and as large: binned splits cut off a
/// few at a time.
Mesh geometric_row(int count, float ratio) {
    Mesh mesh;
    float size = 1e-15f;
    for (int i = 0; i < count; ++i, size *= ratio) {
        const auto first = static_cast<std::uint32_t>(3 * i);
        mesh.positions.insert(mesh.positions.end(), {{size, 0, 0}, {size, size / 4, 0}, {size, 0, size / 4}});
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

template <class T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

}  // namespace

TEST_CASE("nodes are of the size that the layout promises") {
    CHECK(sizeof(BvhNode) == 32);
    CHECK(sizeof(BvhSiblings) == 64);
    CHECK(sizeof(LeafTriangle) == 40);
}

TEST_CASE("each triangle is in one leaf, and each box holds what is below it") {
    for (const Mesh& mesh : {random_soup(3000, 1), bumpy_sphere(4, 2), box_interior(12)}) {
        check_sound(mesh);
        check_sound(mesh, {.split = BvhSplit::median});
        check_sound(mesh, {.bins = 2, .max_leaf_triangles = 1});
        check_sound(mesh, {.bins = 7, .max_leaf_triangles = 64, .box_cost = 10});
    }
}

TEST_CASE("nothing, one triangle, and only degenerate ones") {
    CHECK(build_bvh(Mesh{}).empty());
    CHECK(bvh_stats(build_bvh(Mesh{})).nodes == 0);
    CHECK(build_bvh(Mesh{}).bounds().empty());

    const Mesh one = random_soup(1, 1);
    check_sound(one);
    CHECK(build_bvh(one).node(0).is_leaf());
    CHECK(build_bvh(one).bounds().low == bounds(one).low);

    Mesh points;
    points.positions = {{1, 2, 3}};
    points.triangles.assign(100, {0, 0, 0});
    CHECK(build_bvh(points).empty());
}

TEST_CASE(
    "a thousand copies of one triangle: no split tells them apart, and the tree is shallow all the same") {
    Mesh mesh = random_soup(1, 1);
    mesh.triangles.assign(10000, mesh.triangles[0]);
    check_sound(mesh);
    CHECK(bvh_stats(build_bvh(mesh)).depth <= 11);
    CHECK(closest_hit(build_bvh(mesh), {corners(mesh, 0).at(0.3f, 0.3f) + Vec3{0, 0, 5}, {0, 0, -1}})
              ->triangle == 0);
}

TEST_CASE("depth stays within its limit where splits are as uneven as they get") {
    const Mesh row = geometric_row(200, 1.2f);
    check_sound(row);
    const int free_depth = bvh_stats(build_bvh(row, {.bins = 2, .max_leaf_triangles = 1})).depth;
    CHECK(free_depth > 12);  // so that the limits below bind
    for (const int limit : {8, 10, 12})
        check_sound(row, {.bins = 2, .max_leaf_triangles = 1, .max_depth = limit});

    // Clusters in clusters: small numbers of bins cannot separate them.
    Mesh nested = random_soup(100, 3);
    for (int level = 0; level < 5; ++level) {
        const Mesh inner = scaled_and_moved(nested, 1e-3f, {0, 0, 0});
        const auto first = static_cast<std::uint32_t>(nested.positions.size());
        for (const auto& [a, b, c] : inner.triangles)
            nested.triangles.push_back({first + a, first + b, first + c});
        nested.positions.insert(nested.positions.end(), inner.positions.begin(), inner.positions.end());
    }
    check_sound(nested);
    check_sound(nested, {.bins = 2, .max_leaf_triangles = 1, .max_depth = 16});
}

TEST_CASE("sizes at the ends of float: no split can be priced, and the tree is sound all the same") {
    for (const float scale : {1e-30f, 1e30f}) check_sound(scaled_and_moved(random_soup(500, 1), scale, {}));
}

TEST_CASE("the tree is the same, byte for byte, for any number of threads") {
    Mesh mesh = random_soup(20000, 1);
    for (const BvhSplit split : {BvhSplit::sah, BvhSplit::median}) {
        const Bvh reference = build_bvh(mesh, {.split = split}, 1);
        for (const int threads : {2, 3, 8}) {
            const Bvh bvh = build_bvh(mesh, {.split = split}, threads);
            CHECK(same_bytes(bvh.siblings, reference.siblings));
            CHECK(same_bytes(bvh.triangles, reference.triangles));
        }
    }
    std::swap(mesh.triangles[0], mesh.triangles[1]);
    CHECK_FALSE(same_bytes(build_bvh(mesh).triangles, build_bvh(random_soup(20000, 1)).triangles));
}

TEST_CASE("SAH: the cost on paper of a tree of two far triangles") {
    // Two triangles of 1 x 1 in planes z = 0 and z = 10: the root's half area is 1 + 10 + 10, each leaf's is 1.
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 10}, {1, 0, 10}, {0, 1, 10}};
    mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
    const BvhBuildParams params{.box_cost = 1.5f};
    const BvhStats stats = bvh_stats(build_bvh(mesh, params), params);
    CHECK(stats.nodes == 3);
    CHECK(stats.sah_cost == doctest::Approx(1.5 + 2.0 / 21));
    // Dearer than both triangles: then one leaf is cheaper.
    CHECK(bvh_stats(build_bvh(mesh, {.box_cost = 2})).nodes == 1);
}

TEST_CASE("SAH beats the median where triangles clump, in expected cost and in nodes visited") {
    Mesh mesh = random_soup(2000, 1);
    const Mesh clump = scaled_and_moved(bumpy_sphere(5, 1), 0.05f, {0.2f, 0.3f, 0.1f});
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const auto& [a, b, c] : clump.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
    mesh.positions.insert(mesh.positions.end(), clump.positions.begin(), clump.positions.end());

    const Bvh sah = build_bvh(mesh),
              median = build_bvh(mesh, {.split = BvhSplit::median, .max_leaf_triangles = 2});
    CHECK(bvh_stats(sah).sah_cost < 0.8 * bvh_stats(median).sah_cost);
    HashRng rng(1);
    TraversalCounts sah_counts, median_counts;
    for (int i = 0; i < 2000; ++i) {
        const Ray ray{random_point(rng, sah.bounds()), random_direction(rng)};
        CHECK(closest_hit(sah, ray, AcceptAll{}, sah_counts) ==
              closest_hit(median, ray, AcceptAll{}, median_counts));
    }
    CHECK(double(sah_counts.nodes) < 0.8 * double(median_counts.nodes));
    CHECK(sah_counts.triangles < median_counts.triangles);
}

TEST_CASE("names of splits, both ways") {
    for (const auto& [value, name] : k_bvh_split_names) {
        CHECK(name_of(value) == name);
        CHECK(from_name<BvhSplit>(name) == value);
    }
    CHECK_FALSE(from_name<BvhSplit>("middle"));
}
