/// What holds for every tree and every way to build it, where one line of the oracle says it all.

#include <cmath>

#include "bvh/oracle.hpp"
#include "pathscope/bvh/traverse.hpp"
#include "pathscope/bvh/wide_traverse.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

struct TwoWide {
    static Bvh build(const Mesh& mesh) { return build_bvh(mesh, {.max_leaf_triangles = 1}); }
};
struct TwoWideMedian {
    static Bvh build(const Mesh& mesh) {
        return build_bvh(mesh, {.split = BvhSplit::median, .max_leaf_triangles = 1});
    }
};
struct Wide {
    static WideBvh build(const Mesh& mesh) { return build_wide_bvh(mesh); }
};

}  // namespace

TEST_CASE_TEMPLATE("of coincident triangles the lowest number counts", Tree, TwoWide, TwoWideMedian, Wide) {
    Mesh mesh;
    for (int i = 0; i < 40; ++i) add_quad(mesh, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    const auto bvh = Tree::build(mesh);
    CHECK(closest_hit(bvh, {{0.7f, 0.2f, 1}, {0, 0, -1}})->triangle == 0);
    CHECK(closest_hit(bvh, {{0.2f, 0.7f, 1}, {0, 0, -1}})->triangle == 1);
    CHECK(closest_hit(bvh, {{0.5f, 0.5f, 1}, {0, 0, -1}})->triangle == 0);  // On the diagonal: both.
    const auto not_the_first = [](std::uint32_t triangle, float, float) { return triangle > 4; };
    CHECK(closest_hit(bvh, {{0.7f, 0.2f, 1}, {0, 0, -1}}, not_the_first)->triangle == 6);
}

TEST_CASE_TEMPLATE("an empty mesh, an empty interval, and directions that are none meet nothing", Tree,
                   TwoWide, TwoWideMedian, Wide) {
    const auto empty = Tree::build(Mesh{});
    CHECK_FALSE(closest_hit(empty, {{0, 0, 0}, {0, 0, 1}}));
    CHECK_FALSE(any_hit(empty, {{0, 0, 0}, {0, 0, 1}}));

    const auto sphere = Tree::build(bumpy_sphere(3, 2));
    CHECK(any_hit(sphere, {{0, 0, 0}, {0, 0, 1}}));
    CHECK_FALSE(any_hit(sphere, {{0, 0, 0}, {0, 0, 1}, 0, -1}));
    CHECK_FALSE(closest_hit(sphere, {{0, 0, 0}, {0, 0, 1}, 0, -1}));
    CHECK_FALSE(any_hit(sphere, {{0, 0, 0}, {0, 0, 0}}));
    CHECK_FALSE(any_hit(sphere, {{0, 0, 0}, {0, std::nanf(""), 1}}));
    CHECK_FALSE(closest_hit(sphere, {{std::nanf(""), 0, 0}, {0, 0, 1}}));
}
