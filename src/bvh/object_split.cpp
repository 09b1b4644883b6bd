#include "bvh/object_split.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pathscope {
namespace {

/// Not empty by itself: most sets are small, and would spend more time on emptying all bins than on those that they use.
struct Bin {
    Float4 low, high;
    std::uint32_t count;

    void clear() { *this = {WideBox{}.low, WideBox{}.high, 0}; }
    [[nodiscard]] WideBox box() const { return {low, high}; }
    void add(const WideBox& box, std::uint32_t references) {
        low = min(box.low, low);
        high = max(box.high, high);
        count += references;
    }
};
using AxisBins = std::array<Bin, k_max_split_bins>;

/// Maps centroids to bins, on all axes at once. Finding and applying a split use the same map, so they agree on each side.
class BinMap {
  public:
    BinMap(const WideBox& centroids, int bins) : low_(centroids.low) {
        const Box box = centroids.box();
        alignas(16) std::array<float, 4> scale{}, last{};
        for (int axis = 0; axis < 3; ++axis) {
            const float s = float(bins) / (box.high[axis] - box.low[axis]);
            usable_[std::size_t(axis)] = std::isfinite(s) && s > 0;
            scale[std::size_t(axis)] = usable_[std::size_t(axis)] ? s : 0;
            last[std::size_t(axis)] = float(bins - 1);
        }
        scale_ = load4(scale.data());
        last_ = load4(last.data());
    }

    /// False on an axis along which all centroids coincide, or nearly.
    [[nodiscard]] bool usable(int axis) const { return usable_[std::size_t(axis)]; }
    [[nodiscard]] std::array<std::int32_t, 4> operator()(const WideBox& box) const {
        return truncate(min((box.low + box.high - low_) * scale_, last_));
    }

  private:
    Float4 low_, scale_{}, last_{};
    std::array<bool, 3> usable_{};
};

/// Few references need few bins: the same cost of the tree, in half of the time (Wald 2007).
int bins_for(std::size_t references, int max_bins) {
    return std::min<int>({max_bins, k_max_split_bins, 4 + static_cast<int>(references / 4)});
}

void fill(std::array<AxisBins, 3>& bins, std::span<const Reference> references, const BinMap& map) {
    for (const Reference& reference : references) {
        const WideBox box = box_of(reference);
        const auto place = map(box);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            bins[axis][std::size_t(place[axis])].add(box, 1);
        }
    }
}

/// Sweeps from the right, then from the left, so that each boundary sees both sides.
void improve(std::optional<ObjectSplit>& best, const AxisBins& bins, int axis, int count) {
    std::array<double, k_max_split_bins> right_cost;
    std::array<std::uint32_t, k_max_split_bins> right_count;
    Bin sum;
    sum.clear();
    const auto add = [&sum](const Bin& bin) { sum.add(bin.box(), bin.count); };
    const auto cost_of_sum = [&sum] {
        return sum.count == 0 ? 0 : sum.box().half_area() * blocks_of(sum.count);
    };
    for (auto i = std::size_t(count - 1); i > 0; --i) {
        add(bins[i]);
        right_cost[i] = cost_of_sum();
        right_count[i] = sum.count;
    }
    sum.clear();
    for (std::size_t i = 1; i < std::size_t(count); ++i) {
        add(bins[i - 1]);
        if (sum.count == 0 || right_count[i] == 0) continue;
        const double cost = cost_of_sum() + right_cost[i];
        if (std::isfinite(cost) && (!best || cost < best->cost))
            best = ObjectSplit{axis, int(i), count, cost, {}, {}};
    }
}

Box union_of(std::span<const Bin> bins) {
    WideBox box;
    for (const Bin& bin : bins) box.add(bin.box());
    return box.box();
}

}  // namespace

std::optional<ObjectSplit> find_object_split(std::span<const Reference> references,
                                             const ReferenceBounds& bounds, int max_bins) {
    const int count = bins_for(references.size(), max_bins);
    const BinMap map(bounds.centroids, count);
    std::array<AxisBins, 3> bins;
    for (AxisBins& axis : bins) std::for_each_n(axis.begin(), count, [](Bin& bin) { bin.clear(); });
    fill(bins, references, map);
    std::optional<ObjectSplit> best;
    for (int axis = 0; axis < 3; ++axis)
        if (map.usable(axis)) improve(best, bins[std::size_t(axis)], axis, count);
    if (best) {
        const std::span<const Bin> all(bins[std::size_t(best->axis)].data(), std::size_t(count));
        best->left = union_of(all.first(std::size_t(best->first_right_bin)));
        best->right = union_of(all.subspan(std::size_t(best->first_right_bin)));
    }
    return best;
}

std::size_t partition_at(const ObjectSplit& split, std::span<Reference> references,
                         const ReferenceBounds& bounds) {
    const BinMap map(bounds.centroids, split.bins);
    const auto middle = std::partition(references.begin(), references.end(), [&](const Reference& reference) {
        return map(box_of(reference))[std::size_t(split.axis)] < split.first_right_bin;
    });
    return std::size_t(middle - references.begin());
}

std::size_t partition_at_median(std::span<Reference> references, const ReferenceBounds& bounds) {
    const int axis = bounds.centroids.box().longest_axis();
    const std::size_t half = references.size() / 2;
    std::nth_element(references.begin(), references.begin() + std::ptrdiff_t(half), references.end(),
                     [axis](const Reference& a, const Reference& b) {
                         const float x = a.low[axis] + a.high[axis], y = b.low[axis] + b.high[axis];
                         return x != y ? x < y : a.triangle < b.triangle;
                     });
    return half;
}

}  // namespace pathscope
