#include "bvh/split.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pathscope {
namespace {

constexpr int k_max_bins = 32;

struct Bin {
    Box box;
    std::uint32_t count = 0;
};

/// Maps a centroid's coordinate to a bin. Finding and applying a split use the same map, so they agree on each side.
struct BinMap {
    float low = 0, scale = 0;
    int last = 0;

    BinMap(const Box& centroids, int axis, int bins)
        : low(centroids.low[axis]), scale(float(bins) / (centroids.high[axis] - low)), last(bins - 1) {}

    /// False on an axis along which all centroids coincide, or nearly: there is nothing to split.
    [[nodiscard]] bool usable() const { return std::isfinite(scale) && scale > 0; }
    [[nodiscard]] int operator()(float coordinate) const {
        return std::min(static_cast<int>((coordinate - low) * scale), last);
    }
};

/// Few triangles need few bins: the same cost of the tree, in half of the time (Wald 2007).
int bins_for(std::size_t triangles, const BvhBuildParams& params) {
    return std::min<int>(params.bins, 4 + static_cast<int>(triangles / 4));
}

using Bins = std::array<Bin, k_max_bins>;

/// A count times an area is the expected number of triangle tests, up to the area of the parent.
double tests(const Bin& side) { return double(side.count) * side.box.half_area(); }

void add(Bin& sum, const Bin& bin) {
    sum.box.add(bin.box);
    sum.count += bin.count;
}

/// Sweeps from the right, then from the left, so that each boundary sees both sides.
void improve(std::optional<BinnedSplit>& best, const Bins& bins, int axis, int bin_count, double box_cost,
             double parent_area) {
    std::array<Bin, k_max_bins> right;
    Bin sum;
    for (int i = bin_count - 1; i > 0; --i) {
        add(sum, bins[i]);
        right[i] = sum;
    }
    Bin left;
    for (int i = 1; i < bin_count; ++i) {
        add(left, bins[i - 1]);
        if (left.count == 0 || right[i].count == 0) continue;
        const double cost = box_cost + (tests(left) + tests(right[i])) / parent_area;
        if (std::isfinite(cost) && (!best || cost < best->cost)) best = BinnedSplit{axis, i, cost};
    }
}

}  // namespace

std::optional<BinnedSplit> find_binned_split(std::span<const BuildTriangle> range, const RangeBounds& bounds,
                                             const BvhBuildParams& params) {
    const int bin_count = bins_for(range.size(), params);
    std::optional<BinnedSplit> best;
    for (int axis = 0; axis < 3; ++axis) {
        const BinMap map(bounds.centroids, axis, bin_count);
        if (!map.usable()) continue;
        Bins bins;
        for (const BuildTriangle& triangle : range) {
            Bin& bin = bins[map(triangle.centroid()[axis])];
            bin.box.add(triangle.box);
            ++bin.count;
        }
        improve(best, bins, axis, bin_count, params.box_cost, bounds.boxes.half_area());
    }
    return best;
}

std::size_t partition_at(const BinnedSplit& split, BuildRange range, const RangeBounds& bounds,
                         const BvhBuildParams& params) {
    const BinMap map(bounds.centroids, split.axis, bins_for(range.size(), params));
    const auto middle = std::partition(range.begin(), range.end(), [&](const BuildTriangle& triangle) {
        return map(triangle.centroid()[split.axis]) < split.first_right_bin;
    });
    return static_cast<std::size_t>(middle - range.begin());
}

std::size_t partition_at_median(BuildRange range, const RangeBounds& bounds) {
    const int axis = bounds.centroids.longest_axis();
    const std::size_t half = range.size() / 2;
    std::nth_element(range.begin(), range.begin() + static_cast<std::ptrdiff_t>(half), range.end(),
                     [axis](const BuildTriangle& a, const BuildTriangle& b) {
                         const float x = a.centroid()[axis], y = b.centroid()[axis];
                         return x != y ? x < y : a.triangle < b.triangle;
                     });
    return half;
}

}  // namespace pathscope
