#pragma once
/// Where to divide a set of references in two, each going to one side as a whole.
///
/// The cost is counted in blocks of eight: C = (A_left ceil(N_left / 8) + A_right ceil(N_right / 8)) / A.

#include <optional>
#include <span>

#include "reference.hpp"

namespace pathscope {

inline constexpr int k_max_split_bins = 32;

[[nodiscard]] inline double blocks_of(std::size_t references) { return double((references + 7) / 8); }

/// Between the bins into which the centroids fall along an axis.
struct ObjectSplit {
    int axis = 0;
    int first_right_bin = 0;
    int bins = 0;
    double cost = 0;  ///< Times the area of the parent.
    Box left, right;
};

/// Nothing if all centroids coincide.
[[nodiscard]] std::optional<ObjectSplit> find_object_split(std::span<const Reference> references,
                                                           const ReferenceBounds& bounds, int max_bins);

/// Reorders; returns how many are left of the split, which is neither none nor all.
[[nodiscard]] std::size_t partition_at(const ObjectSplit& split, std::span<Reference> references,
                                       const ReferenceBounds& bounds);

/// Halves by count along the longest axis of the centroids; ties by number. Works for any two references.
[[nodiscard]] std::size_t partition_at_median(std::span<Reference> references, const ReferenceBounds& bounds);

}  // namespace pathscope
