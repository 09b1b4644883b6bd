#pragma once
/// The binary tree from which the wide one is made.

#include <cstdint>
#include <vector>

#include "pathscope/bvh/wide_bvh.hpp"
#include "reference.hpp"

namespace pathscope {

struct BinaryNode {
    Box box;
    std::uint32_t left =
        0;  ///< The right child is left + 1; 0 = none: a leaf. Children come after their parents.
    std::uint32_t begin = 0;  ///< Of BinaryTree::references, those of all leaves below.
    std::uint32_t count = 0;

    [[nodiscard]] bool is_leaf() const { return left == 0; }
};

struct BinaryTree {
    std::vector<BinaryNode> nodes;  ///< The first is the root; empty if nothing can be hit.
    std::vector<Reference> references;
};

/// Leaves hold k_binary_leaf references at most: small, so that the collapse has a choice of blocks.
inline constexpr std::size_t k_binary_leaf = 2;

/// The same for any number of threads.
[[nodiscard]] BinaryTree build_binary_tree(const Mesh& mesh, const WideBuildParams& params, int threads);

/// The cheapest tree with eight children per node that has the same leaves or unions of them.
[[nodiscard]] WideBvh collapse(const BinaryTree& tree, const Mesh& mesh, const WideBuildParams& params);

}  // namespace pathscope
