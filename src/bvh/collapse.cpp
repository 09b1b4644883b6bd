/// From two children to eight.
///
/// forest(n, k) = the least cost of standing for node n by a forest of k trees at most, all of them children of one node:
///
///     forest(n, 1) = min(area(n) C_block if n has at most 8 triangles,
///                        area(n) C_node + min over i of forest(left, i) + forest(right, 8 - i))
///     forest(n, k) = min(forest(n, k - 1), min over i of forest(left, i) + forest(right, k - i))
///
/// Children come after their parents in the array, so one pass from its end finds all of it.

#include <algorithm>
#include <limits>

#include "bvh/binary_tree.hpp"
#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

constexpr std::uint8_t k_as_leaf = 0xff, k_fewer = 0;

struct Plan {
    std::array<float, k_wide> cost;  ///< [k - 1] = forest(n, k); the last one is for k = 8.
    std::array<std::uint8_t, k_wide>
        to_left;  ///< How many of the trees stand for the left child; or k_as_leaf, k_fewer.
    std::uint8_t inner_to_left = 0;  ///< The same for n as a node of its own.
};

struct Best {
    float cost = std::numeric_limits<float>::infinity();
    std::uint8_t to_left = 0;
};

Best best_distribution(const Plan& left, const Plan& right, std::size_t trees) {
    Best best;
    for (std::size_t i = 1; i < trees; ++i) {
        const float cost = left.cost[i - 1] + right.cost[trees - i - 1];
        if (cost < best.cost) best = {cost, static_cast<std::uint8_t>(i)};
    }
    return best;
}

Plan plan_leaf(const BinaryNode& node) {
    Plan plan;
    plan.cost.fill(node.box.half_area());
    plan.to_left.fill(k_fewer);
    plan.to_left[0] = k_as_leaf;
    return plan;
}

Plan plan_inner(const BinaryNode& node, const Plan& left, const Plan& right, float node_cost) {
    Plan plan;
    const float area = node.box.half_area();
    const Best inner = best_distribution(left, right, k_wide);
    plan.inner_to_left = inner.to_left;
    const float as_node = area * node_cost + inner.cost;
    const bool as_leaf = node.count <= k_wide && area <= as_node;
    plan.cost[0] = as_leaf ? area : as_node;
    plan.to_left[0] = as_leaf ? k_as_leaf : inner.to_left;
    for (std::size_t trees = 2; trees <= k_wide; ++trees) {
        const Best best = trees == k_wide ? inner : best_distribution(left, right, trees);
        const bool fewer = plan.cost[trees - 2] <= best.cost;
        plan.cost[trees - 1] = fewer ? plan.cost[trees - 2] : best.cost;
        plan.to_left[trees - 1] = fewer ? k_fewer : best.to_left;
    }
    return plan;
}

class Collapser {
  public:
    Collapser(const BinaryTree& tree, const Mesh& mesh, float node_cost)
        : tree_(tree), mesh_(mesh), plans_(tree.nodes.size()), surface_(tree.nodes.size()) {
        for (std::size_t i = tree.nodes.size(); i-- > 0;) {
            const BinaryNode& node = tree.nodes[i];
            surface_[i] = node.is_leaf() ? surface_of(node) : surface_[node.left] + surface_[node.left + 1];
            plans_[i] = node.is_leaf()
                            ? plan_leaf(node)
                            : plan_inner(node, plans_[node.left], plans_[node.left + 1], node_cost);
        }
    }

    WideBvh run() {
        bvh_.bounds = tree_.nodes[0].box;
        bvh_.nodes.resize(1);
        fill(0, 0, 0);
        return std::move(bvh_);
    }

  private:
    struct Children {
        std::array<std::uint32_t, k_wide> roots;
        std::size_t count = 0;
    };

    /// The roots of the cheapest forest of `trees` trees at most.
    void collect(Children& children, std::uint32_t number, std::size_t trees) const {
        const Plan& plan = plans_[number];
        while (trees > 1 && plan.to_left[trees - 1] == k_fewer) --trees;
        if (trees == 1) {
            children.roots[children.count++] = number;
            return;
        }
        const std::size_t to_left = plan.to_left[trees - 1];
        collect(children, tree_.nodes[number].left, to_left);
        collect(children, tree_.nodes[number].left + 1, trees - to_left);
    }

    [[nodiscard]] Children children_of(std::uint32_t number) const {
        Children children;
        const BinaryNode& node = tree_.nodes[number];
        if (is_block(number)) {  // The whole tree is one block.
            children.roots[children.count++] = number;
        } else {
            const std::size_t to_left = plans_[number].inner_to_left;
            collect(children, node.left, to_left);
            collect(children, node.left + 1, k_wide - to_left);
        }
        // Whoever looks for any hit takes the last first.
        std::stable_sort(
            children.roots.begin(), children.roots.begin() + std::ptrdiff_t(children.count),
            [this](std::uint32_t a, std::uint32_t b) { return surface_per_cost(a) < surface_per_cost(b); });
        return children;
    }

    /// Writes the node that stands for `number`, and all below it.
    void fill(std::uint32_t place, std::uint32_t number, int depth) {
        CHECK(depth < k_wide_max_depth, depth);  // The traversal's stack relies on it.
        const Children children = children_of(number);
        WideNode node;
        // Of a place without a child: an empty box, and block 0, which is harmless to rays that are not numbers.
        for (std::size_t i = 0; i < k_wide; ++i) set_bounds(node, i, Box{});
        node.children.fill(k_leaf_child);
        for (std::size_t i = 0; i < children.count; ++i) {
            const BinaryNode& child = tree_.nodes[children.roots[i]];
            set_bounds(node, i, child.box);
            node.children[i] =
                is_block(children.roots[i]) ? append_block(child) | k_leaf_child : append_node();
        }
        bvh_.nodes[place] = node;
        for (std::size_t i = 0; i < children.count; ++i)
            if (!is_block(children.roots[i])) fill(node.children[i], children.roots[i], depth + 1);
    }

    /// Which child a ray that looks for any hit should try first: a ray that meets the box is stopped with a probability
    /// that grows with surface / area(box), and it costs cost / area(box) to find out.
    [[nodiscard]] float surface_per_cost(std::uint32_t number) const {
        return surface_[number] > 0 ? surface_[number] / plans_[number].cost[0] : 0;
    }

    /// Of what the references of a leaf stand for; of a triangle that was split, no more than its part could have.
    [[nodiscard]] float surface_of(const BinaryNode& node) const {
        float sum = 0;
        for (std::uint32_t i = node.begin; i < node.begin + node.count; ++i) {
            const Reference& reference = tree_.references[i];
            const TriangleCorners t = corners(mesh_, reference.triangle);
            sum += std::min(length(cross(t.b - t.a, t.c - t.a)) / 2, reference.box().half_area());
        }
        return sum;
    }

    [[nodiscard]] bool is_block(std::uint32_t number) const { return plans_[number].to_left[0] == k_as_leaf; }

    static void set_bounds(WideNode& node, std::size_t place, const Box& box) {
        for (int axis = 0; axis < 3; ++axis) {
            node.bounds[std::size_t(axis)][place] = box.low[axis];
            node.bounds[std::size_t(axis) + 3][place] = box.high[axis];
        }
    }

    std::uint32_t append_node() {
        bvh_.nodes.emplace_back();
        return static_cast<std::uint32_t>(bvh_.nodes.size() - 1);
    }

    std::uint32_t append_block(const BinaryNode& node) {
        CHECK(node.count <= k_wide, node.count);
        TriangleBlock block;
        for (std::size_t lane = 0; lane < k_wide; ++lane) {
            const bool used = lane < node.count;
            const std::uint32_t triangle = used ? tree_.references[node.begin + lane].triangle : 0;
            const TriangleCorners t = corners(mesh_, triangle);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const float nothing = std::numeric_limits<float>::quiet_NaN();
                block.corners[0][axis][lane] = used ? t.a[int(axis)] : nothing;
                block.corners[1][axis][lane] = used ? t.b[int(axis)] : nothing;
                block.corners[2][axis][lane] = used ? t.c[int(axis)] : nothing;
            }
            block.triangles[lane] = triangle;
        }
        bvh_.blocks.push_back(block);
        return static_cast<std::uint32_t>(bvh_.blocks.size() - 1);
    }

    const BinaryTree& tree_;
    const Mesh& mesh_;
    std::vector<Plan> plans_;
    std::vector<float> surface_;  ///< Area of the triangles below each node.
    WideBvh bvh_;
};

}  // namespace

WideBvh collapse(const BinaryTree& tree, const Mesh& mesh, const WideBuildParams& params) {
    if (tree.nodes.empty()) return {};
    return Collapser(tree, mesh, params.node_cost).run();
}

WideBvh build_wide_bvh(const Mesh& mesh, const WideBuildParams& params, int threads) {
    CHECK(params.bins >= 2 && params.bins <= 32, params.bins);
    return collapse(build_binary_tree(mesh, params, threads), mesh, params);
}

}  // namespace pathscope
