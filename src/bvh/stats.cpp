#include "pathscope/bvh/bvh.hpp"

namespace pathscope {
namespace {

void add_subtree(BvhStats& stats, const Bvh& bvh, std::uint32_t number, int depth, double box_cost) {
    const BvhNode& node = bvh.node(number);
    const double probability = node.box().half_area() / double(bvh.bounds().half_area());
    ++stats.nodes;
    stats.depth = std::max(stats.depth, depth);
    stats.sah_cost += probability * (node.is_leaf() ? node.count : box_cost);
    if (node.is_leaf()) {
        ++stats.leaves;
        return;
    }
    add_subtree(stats, bvh, node.first, depth + 1, box_cost);
    add_subtree(stats, bvh, node.first + 1, depth + 1, box_cost);
}

}  // namespace

BvhStats bvh_stats(const Bvh& bvh, const BvhBuildParams& params) {
    BvhStats stats;
    stats.triangles = static_cast<std::uint32_t>(bvh.triangles.size());
    stats.bytes = bvh.siblings.size() * sizeof(BvhSiblings) + bvh.triangles.size() * sizeof(LeafTriangle);
    if (!bvh.empty()) add_subtree(stats, bvh, 0, 0, params.box_cost);
    return stats;
}

}  // namespace pathscope
