#pragma once
/// What a traversal tells about itself: the calls that closest_hit and any_hit make on their `probe` argument.
///
/// The probe is a template parameter. NullTraversalProbe has empty members, so that the traversal without
/// instruments is compiled as if they were not there; TraversalCounts counts, for the traversal-cost buffer.
///
/// Stepping through a traversal needs no more than this: a traversal is a pure function of (tree, ray, accept), so a
/// ray that was picked is traced again with a probe that appends each call to a list. Read in order, the list has it
/// all: the current node (enter_node), why a child was not entered (test_box), the stack (postpone_node pushes,
/// an enter_node that does not follow a test_box of the same node pops, and so does drop_node), and the length of the
/// ray, which shrinks at each TriangleOutcome::closest.
///
/// Thread safety: each traversal calls its own probe, from its own thread.
/// Test: tests/bvh/test_traversal_probe.cpp replays the stack from the calls.

#include <cstdint>

namespace pathscope {

enum class TriangleOutcome {
    missed,    ///< The ray passes by, or its interval (which ends at the closest hit so far) does not reach.
    tied,      ///< A hit at the same t as the closest one, which has the lower number.
    rejected,  ///< A hit that `accept` turned down: the hole of a cut-out.
    closest,   ///< The closest so far; the only one, for any_hit.
};

struct NullTraversalProbe {
    /// The node's children are tested next, or, in a leaf, its triangles.
    void enter_node(std::uint32_t /*node*/) {}
    /// t_near: where the ray enters the box, or t_min inside of it; only meaningful if met.
    void test_box(std::uint32_t /*node*/, float /*t_near*/, bool /*met*/) {}
    /// Both children are met: this one, the farther, goes on the stack.
    void postpone_node(std::uint32_t /*node*/, float /*t_near*/) {}
    /// Taken from the stack, but a closer hit has been found since.
    void drop_node(std::uint32_t /*node*/, float /*t_near*/) {}
    /// t_max: where the ray ends after this test.
    void test_triangle(std::uint32_t /*triangle*/, TriangleOutcome /*outcome*/, float /*t_max*/) {}
};

struct TraversalCounts : NullTraversalProbe {
    std::uint64_t nodes = 0, boxes = 0, triangles = 0;

    void enter_node(std::uint32_t /*node*/) { ++nodes; }
    void test_box(std::uint32_t /*node*/, float /*t_near*/, bool /*met*/) { ++boxes; }
    void test_triangle(std::uint32_t /*triangle*/, TriangleOutcome /*outcome*/, float /*t_max*/) {
        ++triangles;
    }
};

}  // namespace pathscope
