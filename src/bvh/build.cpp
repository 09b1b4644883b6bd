#include <bit>

#include "bvh/split.hpp"
#include "pathscope/bvh/bvh.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/core/parallel_for.hpp"

namespace pathscope {
namespace {

/// Ranges above this are split one level at a time, all ranges of a level at once; those below are grown to
/// their leaves, all at once. A constant, so that the order of nodes does not depend on the number of threads.
constexpr std::size_t k_subtree_triangles = 4096;

/// A node whose range is known, but not yet whether it is a leaf.
struct OpenNode {
    std::uint32_t node = 0;
    int depth = 0;
    std::size_t begin = 0, end = 0;  ///< Of BuildTriangles.

    [[nodiscard]] std::size_t size() const { return end - begin; }
};

struct Builder {
    std::vector<BuildTriangle> triangles;
    BvhBuildParams params;

    BuildRange range_of(const OpenNode& open) {
        return BuildRange(triangles).subspan(open.begin, open.size());
    }
};

/// How deep the tree below a range gets at least: halving it down to single triangles.
int levels_of_halving(std::size_t count) { return static_cast<int>(std::bit_width(count - 1)); }

BvhNode make_node(const Box& box, std::uint32_t first, std::uint32_t count) {
    return {{box.low.x, box.low.y, box.low.z, box.high.x, box.high.y, box.high.z}, first, count};
}

/// Reorders the range of a node that is worth splitting, and returns the size of the left part; 0 for a leaf.
std::size_t split(Builder& builder, const OpenNode& open, const RangeBounds& bounds) {
    const BvhBuildParams& params = builder.params;
    const BuildRange range = builder.range_of(open);
    const bool may_be_leaf = range.size() <= static_cast<std::size_t>(params.max_leaf_triangles);
    if (range.size() == 1) return 0;

    // An uneven split may leave all but one triangle on one side; near the depth limit only halving is left.
    const bool deep = open.depth + 1 + levels_of_halving(range.size() - 1) > params.max_depth;
    if (params.split == BvhSplit::median || deep) return may_be_leaf ? 0 : partition_at_median(range, bounds);

    const auto best = find_binned_split(range, bounds, params);
    if (may_be_leaf && (!best || best->cost >= double(range.size()))) return 0;
    return best ? partition_at(*best, range, bounds, params) : partition_at_median(range, bounds);
}

/// Writes the node's box, and its place if it is a leaf; for an inner node, returns the size of its left part.
std::size_t close_node(Builder& builder, const OpenNode& open, BvhNode& node) {
    CHECK(open.depth <= k_bvh_max_depth, open.depth);  // the traversal's stack relies on it
    const RangeBounds bounds = range_bounds(builder.range_of(open));
    const std::size_t left = split(builder, open, bounds);
    node = make_node(bounds.boxes, static_cast<std::uint32_t>(open.begin),
                     left == 0 ? static_cast<std::uint32_t>(open.size()) : 0);
    return left;
}

/// The nodes of a tree while it grows; the first siblings are its root and the unused node.
class Nodes {
  public:
    Nodes() : siblings_(1) {}

    BvhNode& operator[](std::uint32_t number) { return siblings_[number / 2].nodes[number % 2]; }

    /// Returns the number of the left one.
    std::uint32_t append_siblings() {
        siblings_.emplace_back();
        return static_cast<std::uint32_t>(2 * (siblings_.size() - 1));
    }

    /// Puts a tree that was grown on its own in the place of a node.
    void graft(std::uint32_t place, const Nodes& subtree) {
        const auto shift = static_cast<std::uint32_t>(2 * (siblings_.size() - 1));
        const auto moved = [shift](const BvhNode& node) {
            return BvhNode{node.bounds, node.is_leaf() ? node.first : node.first + shift, node.count};
        };
        (*this)[place] = moved(subtree.siblings_[0].nodes[0]);
        for (std::size_t i = 1; i < subtree.siblings_.size(); ++i) {
            const auto& [left, right] = subtree.siblings_[i].nodes;
            siblings_.push_back({moved(left), moved(right)});
        }
    }

    std::vector<BvhSiblings> take() { return std::move(siblings_); }

  private:
    std::vector<BvhSiblings> siblings_;
};

struct OpenPair {
    OpenNode left, right;
};

/// Makes two new nodes the children of `parent`.
OpenPair append_children(Nodes& nodes, const OpenNode& parent, std::size_t left) {
    const std::uint32_t first = nodes.append_siblings();
    nodes[parent.node].first = first;
    return {{first, parent.depth + 1, parent.begin, parent.begin + left},
            {first + 1, parent.depth + 1, parent.begin + left, parent.end}};
}

/// Down to the leaves, depth first.
void grow(Builder& builder, Nodes& nodes, const OpenNode& open) {
    const std::size_t left = close_node(builder, open, nodes[open.node]);
    if (left == 0) return;
    const OpenPair children = append_children(nodes, open, left);
    grow(builder, nodes, children.left);
    grow(builder, nodes, children.right);
}

/// Splits the top of the tree, level by level, until all ranges are small; returns those.
std::vector<OpenNode> grow_top(Builder& builder, Nodes& nodes, int threads) {
    std::vector<OpenNode> small;
    std::vector<OpenNode> level{{0, 0, 0, builder.triangles.size()}};
    while (!level.empty()) {
        std::vector<std::size_t> lefts(level.size());
        const auto wide = std::stable_partition(level.begin(), level.end(), [](const OpenNode& open) {
            return open.size() > k_subtree_triangles;
        });
        small.insert(small.end(), wide, level.end());
        level.erase(wide, level.end());
        parallel_for(static_cast<std::int64_t>(level.size()), threads,
                     [&](int i) { lefts[i] = close_node(builder, level[i], nodes[level[i].node]); });

        std::vector<OpenNode> next;
        for (std::size_t i = 0; i < level.size(); ++i) {
            const OpenPair children = append_children(nodes, level[i], lefts[i]);
            next.push_back(children.left);
            next.push_back(children.right);
        }
        level = std::move(next);
    }
    return small;
}

std::vector<BuildTriangle> gather(const Mesh& mesh) {
    std::vector<BuildTriangle> gathered;
    gathered.reserve(mesh.triangles.size());
    for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
        const TriangleCorners triangle = corners(mesh, i);
        const Box box = bounds(triangle);
        CHECK(is_finite(box.low) && is_finite(box.high), i);
        if (!is_degenerate(triangle)) gathered.push_back({box, i});
    }
    return gathered;
}

std::vector<LeafTriangle> copy_corners(const Mesh& mesh, const std::vector<BuildTriangle>& order,
                                       int threads) {
    std::vector<LeafTriangle> leaves(order.size());
    parallel_for(
        static_cast<std::int64_t>(order.size()), threads,
        [&](int i) {
            const TriangleCorners t = corners(mesh, order[i].triangle);
            leaves[i] = {as_corner(t.a), as_corner(t.b), as_corner(t.c), order[i].triangle};
        },
        k_subtree_triangles);
    return leaves;
}

}  // namespace

Bvh build_bvh(const Mesh& mesh, const BvhBuildParams& params, int threads) {
    CHECK(params.bins >= 2 && params.bins <= 32, params.bins);
    CHECK(params.max_leaf_triangles >= 1 && params.max_leaf_triangles <= 64, params.max_leaf_triangles);
    CHECK(params.max_depth <= k_bvh_max_depth, params.max_depth);
    Builder builder{gather(mesh), params};
    if (builder.triangles.empty()) return {};
    CHECK(levels_of_halving(builder.triangles.size()) <= params.max_depth, builder.triangles.size());

    Nodes nodes;
    const std::vector<OpenNode> small = grow_top(builder, nodes, threads);
    std::vector<Nodes> subtrees(small.size());
    parallel_for(static_cast<std::int64_t>(small.size()), threads, [&](int i) {
        grow(builder, subtrees[i], {0, small[i].depth, small[i].begin, small[i].end});
    });
    for (std::size_t i = 0; i < small.size(); ++i) nodes.graft(small[i].node, subtrees[i]);
    return {nodes.take(), copy_corners(mesh, builder.triangles, threads)};
}

}  // namespace pathscope
