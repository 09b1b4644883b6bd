#pragma once
/// The bounding volume hierarchy: a binary tree of boxes over the triangles, so that a ray tests about ten of them
/// instead of all.
///
/// Where to split a node is decided by the surface area heuristic (SAH): a ray that meets the node's box meets a box
/// inside it with probability area(child) / area(node), hence the expected cost of a split is
///
///     C_split = C_box + C_tri (A_left N_left + A_right N_right) / A_node        against    C_leaf = C_tri N
///
/// It is evaluated between the bins into which the centroids are sorted, on all three axes, and the cheapest wins.
///
/// Layout: a node takes 32 bytes, and siblings lie side by side in one cache line, which one visit reads. Node 2i + j is
/// nodes[j] of siblings[i]; node 0 is the root, node 1 is unused. The triangles of a leaf lie side by side
/// too, copied with their corners (40 bytes each), so that a leaf is read without a detour through the mesh.
///
/// Ensures: the same tree, byte for byte, for any number of threads. Depth at most k_bvh_max_depth, whatever the scene:
/// where a chain of uneven splits would grow deeper, nodes are split into halves by count. Degenerate triangles are
/// left out: they are never hit.
/// Requires: validate(mesh) passed (finite numbers).
/// Thread safety: build_bvh is pure; a Bvh is read by any number of threads.
/// Source: MacDonald & Booth 1990; Wald 2007, "On fast Construction of SAH-based Bounding Volume Hierarchies".
/// Test: tests/bvh/test_build.cpp     Lesson: the split `median` is there to be compared with `sah`.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/geometry/mesh.hpp"
#include "pathscope/geometry/triangle.hpp"
#include "pathscope/math/box.hpp"

namespace pathscope {

inline constexpr int k_bvh_max_depth = 64;  ///< Of the deepest leaf, the root having depth 0.

struct alignas(32) BvhNode {
    std::array<float, 6> bounds{};  ///< low x, y, z, high x, y, z: an index of 0 or 3 picks the side.
    std::uint32_t first = 0;  ///< Inner node: children are `first` and `first + 1`. Leaf: its first triangle.
    std::uint32_t count = 0;  ///< Triangles of a leaf; 0 for an inner node.

    [[nodiscard]] bool is_leaf() const { return count > 0; }
    [[nodiscard]] Box box() const {
        return {{bounds[0], bounds[1], bounds[2]}, {bounds[3], bounds[4], bounds[5]}};
    }
};

struct alignas(64) BvhSiblings {
    std::array<BvhNode, 2> nodes;
};

struct LeafTriangle {
    Corner a, b, c;
    std::uint32_t triangle;  ///< Number in Mesh::triangles.
};

struct Bvh {
    std::vector<BvhSiblings> siblings;    ///< Empty if nothing can be hit.
    std::vector<LeafTriangle> triangles;  ///< In the order of the leaves.

    [[nodiscard]] bool empty() const { return siblings.empty(); }
    [[nodiscard]] const BvhNode& node(std::uint32_t number) const {
        return siblings[number / 2].nodes[number % 2];
    }
    [[nodiscard]] Box bounds() const { return empty() ? Box{} : node(0).box(); }
};

enum class BvhSplit {
    sah,     ///< Cheapest by the surface area heuristic.
    median,  ///< Halves by count along the longest axis of the centroids: the textbook's strawman.
};
inline constexpr std::array k_bvh_split_names{
    EnumName{BvhSplit::sah, "sah"},
    EnumName{BvhSplit::median, "median"},
};
constexpr const auto& enum_table(BvhSplit) { return k_bvh_split_names; }

struct BvhBuildParams {
    BvhSplit split = BvhSplit::sah;
    int bins = 32;               ///< Per axis, 2 to 32; small nodes use fewer.
    int max_leaf_triangles = 8;  ///< A node with more is always split; 1 to 64.
    float box_cost = 1;          ///< C_box: of visiting a node (both children's boxes), in triangle tests.
    int max_depth = k_bvh_max_depth;
};

/// threads: 0 = all cores.
[[nodiscard]] Bvh build_bvh(const Mesh& mesh, const BvhBuildParams& params = {}, int threads = 0);

struct BvhStats {
    std::uint32_t triangles = 0;  ///< In leaves; the mesh may have degenerate ones besides.
    std::uint32_t nodes = 0;      ///< Inner ones and leaves.
    std::uint32_t leaves = 0;
    int depth = 0;          ///< Of the deepest leaf.
    double sah_cost = 0;    ///< Expected cost of a ray that meets the root, in triangle tests.
    std::size_t bytes = 0;  ///< Of nodes and triangles.
};
[[nodiscard]] BvhStats bvh_stats(const Bvh& bvh, const BvhBuildParams& params = {});

}  // namespace pathscope
