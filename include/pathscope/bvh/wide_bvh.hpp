#pragma once
/// The wide tree: eight children to a node, eight triangles to a leaf, so that one instruction tests eight of them.
///
///     C = C_node + sum over children of area(child) / area(node) * C(child),      C(leaf) = C_block
///
/// Why: a ray that goes down a binary tree takes three steps where it takes one here, and each step is a load that the next
/// one waits for and a branch that nobody can predict. Eight boxes at once cost as much as one.
///
/// Since a leaf costs the same whether it holds one triangle or eight, the build knows it: it counts blocks of eight, not
/// triangles. It makes a binary tree first, from references to triangles sorted into bins (SAH, as bvh.hpp). Where large
/// triangles make boxes overlap, a reference is split by a plane into two with tighter boxes (spatial splits): the
/// triangle lies in two leaves then, and a ray that finds it twice finds the same hit. Of all ways to turn that tree into
/// one with eight children, dynamic programming finds the cheapest.
///
/// Layout: a node takes 256 bytes, four cache lines; the bounds of its children lie plane by plane, ready for the vector
/// registers. A block of eight triangles takes 320 bytes.
///
/// Ensures: the same tree, byte for byte, for any number of threads and any instruction set. The answers of closest_hit
/// and any_hit (wide_traverse.hpp) are those of testing all triangles one by one, bit for bit, as with the binary tree.
/// Requires: validate(mesh) passed (finite numbers).
/// Thread safety: build_wide_bvh is pure; a WideBvh is read by any number of threads.
/// Source: Wald, Benthin & Boulos 2008, "Getting Rid of Packets" (many children); Stich, Friedrich & Dietrich 2009, "Spatial
/// Splits in Bounding Volume Hierarchies"; Ylitie, Karras & Laine 2017, section 3.2 (the dynamic programme).
/// Test: tests/bvh/test_wide.cpp

#include <array>
#include <cstddef>
#include <cstdint>

#include "pathscope/core/huge_pages.hpp"
#include "pathscope/geometry/mesh.hpp"
#include "pathscope/math/box.hpp"

namespace pathscope {

inline constexpr int k_wide = 8;
inline constexpr int k_wide_max_depth = 64;
inline constexpr std::uint32_t k_leaf_child = 0x80000000u;  ///< Marks a child that is a block of triangles.

struct alignas(64) WideNode {
    /// Low x, y, z, high x, y, z of each child; a place without a child has low = infinity, high = -infinity, which no ray
    /// meets.
    std::array<std::array<float, k_wide>, 6> bounds;
    /// Number of a node, or of a block | k_leaf_child; block 0 for none.
    std::array<std::uint32_t, k_wide> children;
    std::array<std::uint32_t, k_wide> unused{};  ///< Fills the fourth cache line, with zeros.
};

struct alignas(64) TriangleBlock {
    /// [corner][axis][lane]; NaN in lanes without a triangle, which no ray meets.
    std::array<std::array<std::array<float, k_wide>, 3>, 3> corners;
    std::array<std::uint32_t, k_wide> triangles;  ///< Numbers in Mesh::triangles.
};

struct WideBvh {
    HugePageVector<WideNode> nodes;  ///< The first is the root; empty if nothing can be hit.
    HugePageVector<TriangleBlock> blocks;
    Box bounds;

    [[nodiscard]] bool empty() const { return nodes.empty(); }
};

struct WideBuildParams {
    int bins = 32;                  ///< Per axis, 2 to 32; small nodes use fewer.
    float node_cost = 1;            ///< Of a visit to a node, in visits to a block of triangles.
    float spatial_gain = 0.05f;     ///< Part of the cost that a spatial split must save; 1 = none is made.
    float extra_references = 0.5f;  ///< How many, at most, spatial splits may add, per triangle.
};

/// threads: 0 = all cores.
[[nodiscard]] WideBvh build_wide_bvh(const Mesh& mesh, const WideBuildParams& params = {}, int threads = 0);

struct WideBvhStats {
    std::size_t nodes = 0, blocks = 0;
    std::size_t references = 0;  ///< Triangles in blocks; those that were split count each time.
    int depth = 0;
    double cost = 0;        ///< Expected cost of a ray that meets the root, in visits to blocks.
    std::size_t bytes = 0;  ///< Of nodes and blocks.
};
[[nodiscard]] WideBvhStats wide_bvh_stats(const WideBvh& bvh, const WideBuildParams& params = {});

}  // namespace pathscope
