#include "bvh/binary_tree.hpp"

#include <algorithm>
#include <bit>
#include <optional>

#include "bvh/object_split.hpp"
#include "bvh/spatial_split.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/core/parallel_for.hpp"

namespace pathscope {
namespace {

/// Sets above this are divided one level at a time, all sets of a level at once; those below grow to their leaves, all at
/// once. A constant, so that the tree does not depend on the number of threads.
constexpr std::size_t k_subtree_references = 4096;
/// Cutting triangles gains little where the boxes of an object split overlap by less than this part of their parent, or of the
/// root, or where the triangles would fit into a few blocks anyway.
constexpr float k_overlap_of_parent = 0.2f, k_overlap_of_root = 1e-5f;
constexpr std::size_t k_uncut_references = 2 * k_wide;
/// Of nodes that are not made by halving alone. What is left to the limit of the wide tree is room for references that cuts add.
constexpr int k_max_binary_depth = k_wide_max_depth - 16;

struct Rules {
    const Mesh& mesh;
    WideBuildParams params;
    float root_area = 0;
};

/// How many references cuts may still add.
using Budget = std::ptrdiff_t;

Box intersection(const Box& a, const Box& b) { return {max(a.low, b.low), min(a.high, b.high)}; }

int levels_of_halving(std::size_t count) { return static_cast<int>(std::bit_width(count - 1)); }

/// Whether cutting triangles may gain anything over an object split.
bool may_cut(const Rules& rules, std::size_t references, const ReferenceBounds& bounds,
             const std::optional<ObjectSplit>& object, Budget budget) {
    if (budget <= 0 || references <= k_uncut_references || rules.params.spatial_gain >= 1) return false;
    if (!object) return true;
    const float worthwhile =
        std::max(k_overlap_of_parent * bounds.boxes.half_area(), k_overlap_of_root * rules.root_area);
    return intersection(object->left, object->right).half_area() > worthwhile;
}

/// Divides by a plane if that gains enough; returns where the references of the right side begin.
std::optional<std::size_t> divide_by_plane(const Rules& rules, std::vector<Reference>& references,
                                           std::size_t begin, const ReferenceBounds& bounds,
                                           const std::optional<ObjectSplit>& object, Budget& budget) {
    const std::span<const Reference> all = std::span(references).subspan(begin);
    const auto split = find_spatial_split(rules.mesh, all, bounds.boxes.box());
    if (!split || Budget(split->left + split->right - all.size()) > budget) return std::nullopt;
    if (object && split->cost >= (1 - rules.params.spatial_gain) * object->cost) return std::nullopt;

    const std::size_t before = references.size();
    const std::size_t middle = divide_at(*split, rules.mesh, references, begin);
    budget -= Budget(references.size() - before);
    if (middle > begin && middle < references.size()) return middle;
    // The bins were off by a rounding, and one side is empty.
    const std::span<Reference> cut = std::span(references).subspan(begin);
    return begin + partition_at_median(cut, bounds_of(cut));
}

/// Divides the references from `begin` on in two; returns where those of the right begin.
std::size_t divide(const Rules& rules, std::vector<Reference>& references, std::size_t begin,
                   const ReferenceBounds& bounds, int depth, Budget& budget) {
    const std::span<Reference> all = std::span(references).subspan(begin);
    // An uneven split may leave all but one reference on one side; near the depth limit only halving is left.
    if (depth + 1 + levels_of_halving(all.size() - 1) > k_max_binary_depth)
        return begin + partition_at_median(all, bounds);

    const auto object = find_object_split(all, bounds, rules.params.bins);
    if (may_cut(rules, all.size(), bounds, object, budget))
        if (const auto middle = divide_by_plane(rules, references, begin, bounds, object, budget))
            return *middle;
    return begin + (object ? partition_at(*object, all, bounds) : partition_at_median(all, bounds));
}

/// A subtree that is grown on its own, depth first, the right child before the left one: the references that are still to be
/// divided lie on a stack, so cuts may add to those on its top.
class Subtree {
  public:
    Subtree(const Rules& rules, std::vector<Reference> references, int depth, Budget budget)
        : rules_(rules), stack_(std::move(references)), budget_(budget) {
        tree_.nodes.emplace_back();
        grow(0, 0, depth);
    }
    BinaryTree take() { return std::move(tree_); }

  private:
    void grow(std::uint32_t node, std::size_t begin, int depth) {
        const std::span<const Reference> all = std::span(std::as_const(stack_)).subspan(begin);
        const ReferenceBounds bounds = bounds_of(all);
        const auto first = static_cast<std::uint32_t>(tree_.references.size());
        tree_.nodes[node].box = bounds.boxes.box();
        if (all.size() <= k_binary_leaf) {
            tree_.references.insert(tree_.references.end(), all.begin(), all.end());
            stack_.resize(begin);
        } else {
            const std::size_t middle = divide(rules_, stack_, begin, bounds, depth, budget_);
            const auto left = static_cast<std::uint32_t>(tree_.nodes.size());
            tree_.nodes[node].left = left;
            tree_.nodes.resize(left + 2);
            grow(left + 1, middle, depth + 1);
            grow(left, begin, depth + 1);
        }
        tree_.nodes[node].begin = first;
        tree_.nodes[node].count = static_cast<std::uint32_t>(tree_.references.size()) - first;
    }

    const Rules& rules_;
    std::vector<Reference> stack_;
    Budget budget_;
    BinaryTree tree_;
};

/// A node of the top of the tree, with what it will hold.
struct OpenNode {
    std::uint32_t node = 0;
    int depth = 0;
    std::vector<Reference> references;
    Budget budget = 0;
};

struct Halves {
    OpenNode left, right;
    Box box;
};

Halves divide_open(const Rules& rules, OpenNode& open) {
    const ReferenceBounds bounds = bounds_of(open.references);
    const std::size_t middle = divide(rules, open.references, 0, bounds, open.depth, open.budget);
    Halves halves;
    halves.box = bounds.boxes.box();
    const std::size_t total = open.references.size();
    halves.right.references.assign(open.references.begin() + std::ptrdiff_t(middle), open.references.end());
    open.references.resize(middle);
    halves.left.references = std::move(open.references);
    halves.left.depth = halves.right.depth = open.depth + 1;
    halves.left.budget = Budget(double(open.budget) * double(middle) / double(total));
    halves.right.budget = open.budget - halves.left.budget;
    return halves;
}

/// Divides the top of the tree, level by level, until all sets are small; returns those.
std::vector<OpenNode> grow_top(const Rules& rules, std::vector<BinaryNode>& nodes, OpenNode root,
                               int threads) {
    std::vector<OpenNode> small, level;
    level.push_back(std::move(root));
    while (!level.empty()) {
        std::vector<OpenNode> large;
        for (OpenNode& open : level)
            (open.references.size() > k_subtree_references ? large : small).push_back(std::move(open));
        std::vector<Halves> halves(large.size());
        parallel_for(std::int64_t(large.size()), threads,
                     [&](int i) { halves[std::size_t(i)] = divide_open(rules, large[std::size_t(i)]); });
        level.clear();
        for (std::size_t i = 0; i < large.size(); ++i) {
            const auto left = static_cast<std::uint32_t>(nodes.size());
            nodes[large[i].node].left = left;
            nodes[large[i].node].box = halves[i].box;
            nodes.resize(left + 2);
            halves[i].left.node = left;
            halves[i].right.node = left + 1;
            level.push_back(std::move(halves[i].left));
            level.push_back(std::move(halves[i].right));
        }
    }
    return small;
}

/// Puts a subtree in the place of a node.
void graft(BinaryTree& tree, std::uint32_t place, const BinaryTree& subtree) {
    const auto node_shift = static_cast<std::uint32_t>(tree.nodes.size()) - 1;
    const auto reference_shift = static_cast<std::uint32_t>(tree.references.size());
    const auto moved = [&](BinaryNode node) {
        if (!node.is_leaf()) node.left += node_shift;
        node.begin += reference_shift;
        return node;
    };
    tree.nodes[place] = moved(subtree.nodes[0]);
    for (std::size_t i = 1; i < subtree.nodes.size(); ++i) tree.nodes.push_back(moved(subtree.nodes[i]));
    tree.references.insert(tree.references.end(), subtree.references.begin(), subtree.references.end());
}

std::vector<Reference> references_to(const Mesh& mesh) {
    std::vector<Reference> references;
    references.reserve(mesh.triangles.size());
    for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
        const TriangleCorners triangle = corners(mesh, i);
        const Box box = bounds(triangle);
        CHECK(is_finite(box.low) && is_finite(box.high), i);
        if (!is_degenerate(triangle)) references.push_back({box.low, i, box.high, 0});
    }
    return references;
}

}  // namespace

BinaryTree build_binary_tree(const Mesh& mesh, const WideBuildParams& params, int threads) {
    OpenNode root;
    root.references = references_to(mesh);
    if (root.references.empty()) return {};
    root.budget = Budget(params.extra_references * float(root.references.size()));
    const Rules rules{mesh, params, bounds_of(root.references).boxes.half_area()};

    BinaryTree tree;
    tree.nodes.emplace_back();
    std::vector<OpenNode> small = grow_top(rules, tree.nodes, std::move(root), threads);
    std::vector<BinaryTree> subtrees(small.size());
    parallel_for(std::int64_t(small.size()), threads, [&](int i) {
        OpenNode& open = small[std::size_t(i)];
        subtrees[std::size_t(i)] = Subtree(rules, std::move(open.references), open.depth, open.budget).take();
    });
    for (std::size_t i = 0; i < small.size(); ++i) graft(tree, small[i].node, subtrees[i]);
    // Only now are the ranges of the top known: not contiguous, but large, and never made a block.
    for (std::size_t i = tree.nodes.size(); i-- > 0;) {
        BinaryNode& node = tree.nodes[i];
        if (!node.is_leaf()) node.count = tree.nodes[node.left].count + tree.nodes[node.left + 1].count;
    }
    return tree;
}

}  // namespace pathscope
