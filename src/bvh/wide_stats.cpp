#include <algorithm>
#include <cmath>

#include "pathscope/bvh/wide_bvh.hpp"

namespace pathscope {
namespace {

void add_node(WideBvhStats& stats, const WideBvh& bvh, std::uint32_t number, double area, int depth,
              double node_cost) {
    const WideNode& node = bvh.nodes[number];
    const double root_area = bvh.bounds.half_area();
    stats.cost += node_cost * area / root_area;
    stats.depth = std::max(stats.depth, depth);
    for (std::size_t i = 0; i < k_wide; ++i) {
        const Box box{{node.bounds[0][i], node.bounds[1][i], node.bounds[2][i]},
                      {node.bounds[3][i], node.bounds[4][i], node.bounds[5][i]}};
        if (box.empty()) continue;
        if (node.children[i] & k_leaf_child)
            stats.cost += box.half_area() / root_area;
        else
            add_node(stats, bvh, node.children[i], box.half_area(), depth + 1, node_cost);
    }
}

}  // namespace

WideBvhStats wide_bvh_stats(const WideBvh& bvh, const WideBuildParams& params) {
    WideBvhStats stats;
    stats.nodes = bvh.nodes.size();
    stats.blocks = bvh.blocks.size();
    stats.bytes = stats.nodes * sizeof(WideNode) + stats.blocks * sizeof(TriangleBlock);
    for (const TriangleBlock& block : bvh.blocks)
        for (const float x : block.corners[0][0]) stats.references += std::isnan(x) ? 0 : 1;
    if (!bvh.empty()) add_node(stats, bvh, 0, bvh.bounds.half_area(), 0, params.node_cost);
    return stats;
}

}  // namespace pathscope
