#pragma once
/// Policies of where to split a range of triangles in two. All are pure functions of the range: threads do not
/// matter.

#include <optional>

#include "bvh/build_range.hpp"
#include "pathscope/bvh/bvh.hpp"

namespace pathscope {

/// The cheapest split between bins, and what it costs for a ray that meets the range's box.
struct BinnedSplit {
    int axis = 0;
    int first_right_bin = 0;
    double cost = 0;  ///< C_box + C_tri (A_left N_left + A_right N_right) / A, with C_tri = 1.
};

/// Nothing if all centroids coincide, or the boxes have no area to compare.
[[nodiscard]] std::optional<BinnedSplit> find_binned_split(std::span<const BuildTriangle> range,
                                                           const RangeBounds& bounds,
                                                           const BvhBuildParams& params);

/// Reorders the range; returns how many are left of the split, which is neither none nor all.
[[nodiscard]] std::size_t partition_at(const BinnedSplit& split, BuildRange range, const RangeBounds& bounds,
                                       const BvhBuildParams& params);

/// Halves by count along the longest axis of the centroids; ties by number. Works for any two triangles.
[[nodiscard]] std::size_t partition_at_median(BuildRange range, const RangeBounds& bounds);

}  // namespace pathscope
