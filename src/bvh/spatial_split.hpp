#pragma once
/// Where to divide a set of references by a plane: those that it crosses are cut in two, with tighter boxes.
///
/// Why: no way of sending a large triangle to one side or the other keeps its box out of the way of its neighbours. Cut in
/// two it is in both leaves, but each box holds only what is there.
///
/// Source: Stich, Friedrich & Dietrich 2009.   Test: tests/bvh/test_spatial_split.cpp

#include <optional>
#include <span>
#include <vector>

#include "reference.hpp"

namespace pathscope {

struct SpatialSplit {
    int axis = 0;
    float plane = 0;
    double cost = 0;                  ///< As ObjectSplit's.
    std::size_t left = 0, right = 0;  ///< References on each side; those cut count twice.
};

/// Nothing if no plane has references on both sides.
[[nodiscard]] std::optional<SpatialSplit> find_spatial_split(const Mesh& mesh,
                                                             std::span<const Reference> references,
                                                             const Box& bounds);

/// Divides the references from `begin` to the end: those on the left stay in front, those on the right go behind them,
/// with the right halves of those that were cut. Returns where the right ones begin.
[[nodiscard]] std::size_t divide_at(const SpatialSplit& split, const Mesh& mesh,
                                    std::vector<Reference>& references, std::size_t begin);

/// The parts of a reference on the two sides of a plane that crosses its box. Their boxes together hold all that its own box
/// holds of the triangle, whatever is rounded. Requires: coordinates as geometry/triangle.hpp.
struct CutReference {
    Reference left, right;
};
[[nodiscard]] CutReference cut(const Mesh& mesh, const Reference& reference, int axis, float plane);

}  // namespace pathscope
