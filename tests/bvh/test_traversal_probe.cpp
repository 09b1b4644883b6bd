#include "pathscope/bvh/traversal_probe.hpp"

#include <vector>

#include "geometry/test_meshes.hpp"
#include "pathscope/bvh/traverse.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// A stepper in small: replays the traversal's stack from the calls alone.
struct Replay : NullTraversalProbe {
    std::vector<std::uint32_t> stack, entered, leaf_triangles;
    std::vector<std::uint32_t> met;  ///< Boxes met since the last node was entered.
    float t_closest = k_infinity;
    std::uint32_t closest = 0;
    int dropped = 0, surprises = 0;

    void enter_node(std::uint32_t node) {
        // Entered straight from its parent, or else the top of the stack.
        const bool from_parent = std::find(met.begin(), met.end(), node) != met.end();
        if (!from_parent) pop(node);
        met.clear();
        entered.push_back(node);
    }
    void test_box(std::uint32_t node, float /*t_near*/, bool is_met) {
        if (is_met) met.push_back(node);
    }
    void postpone_node(std::uint32_t node, float /*t_near*/) {
        surprises += std::erase(met, node) != 1;
        stack.push_back(node);
    }
    void drop_node(std::uint32_t node, float t_near) {
        ++dropped;
        surprises += t_near <= t_closest;
        pop(node);
    }
    void test_triangle(std::uint32_t triangle, TriangleOutcome outcome, float t_max) {
        leaf_triangles.push_back(triangle);
        if (outcome != TriangleOutcome::closest) return;
        surprises += t_max > t_closest;
        t_closest = t_max;
        closest = triangle;
    }

    void pop(std::uint32_t node) {
        surprises += stack.empty() || stack.back() != node;
        if (!stack.empty()) stack.pop_back();
    }
};

}  // namespace

TEST_CASE("the calls tell the whole traversal: stack, order, and how the ray shrank") {
    const Mesh mesh = random_soup(2000, 1);
    const Bvh bvh = build_bvh(mesh);
    HashRng rng(1);
    int dropped = 0;
    for (int i = 0; i < 500; ++i) {
        const Ray ray{random_point(rng, bvh.bounds()), random_direction(rng)};
        Replay replay;
        const auto hit = closest_hit(bvh, ray, AcceptAll{}, replay);
        CHECK(replay.surprises == 0);
        CHECK(replay.stack.empty());
        CHECK(replay.entered.front() == 0);
        if (hit) {
            CHECK(replay.closest == hit->triangle);
            CHECK(replay.t_closest == hit->t);
        }
        std::size_t in_leaves = 0;
        for (const std::uint32_t node : replay.entered) in_leaves += bvh.node(node).count;
        CHECK(replay.leaf_triangles.size() == in_leaves);
        dropped += replay.dropped;

        TraversalCounts counts;
        CHECK(closest_hit(bvh, ray, AcceptAll{}, counts) == hit);
        CHECK(counts.nodes == replay.entered.size());
        CHECK(counts.triangles == in_leaves);
        CHECK(counts.boxes % 2 == 1);  // the root, then pairs
    }
    CHECK(dropped > 100);
}

TEST_CASE("outcomes: rejected hits, ties and misses are told apart") {
    Mesh mesh;
    for (int i = 0; i < 3; ++i) add_quad(mesh, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    const Bvh bvh = build_bvh(mesh);
    REQUIRE(bvh.node(0).is_leaf());
    struct Outcomes : NullTraversalProbe {
        int count[4] = {};
        void test_triangle(std::uint32_t, TriangleOutcome outcome, float) {
            ++count[static_cast<int>(outcome)];
        }
    } closest, any;
    const auto not_the_first = [](std::uint32_t triangle, float, float) { return triangle != 0; };
    const Ray ray{{0.7f, 0.2f, 1}, {0, 0, -1}};
    CHECK(closest_hit(bvh, ray, not_the_first, closest)->triangle == 2);
    CHECK(closest.count[static_cast<int>(TriangleOutcome::missed)] == 3);
    CHECK(closest.count[static_cast<int>(TriangleOutcome::rejected)] == 1);
    CHECK(closest.count[static_cast<int>(TriangleOutcome::closest)] == 1);
    CHECK(closest.count[static_cast<int>(TriangleOutcome::tied)] == 1);
    CHECK(any_hit(bvh, ray, not_the_first, any));
    CHECK(any.count[static_cast<int>(TriangleOutcome::closest)] == 1);
}
