#pragma once
/// What a scout saw: the noise of each block, and how bright the frame is.
///
///   sigma^2 = (h0 - h1)^2 / (1 / n0 + 1 / n1)       h0, h1 means of n0, n1 samples of one pixel and channel
///
/// Why two halves: their difference needs no true mean, no squares have to cross the wire, and the halves are exact
/// integers, so that the estimate, added up in one fixed order, has the same bits everywhere. One degree of freedom per
/// pixel and channel: 3,072 in a block of 32 x 32.
/// Requires of all: halves over the same grid, of independent samples, at least one of each in every block.
/// Units: radiance for the mean, its square for variances. Thread safety: pure.   Test: tests/render/test_scout.cpp

#include <cstdint>
#include <vector>

#include "pathscope/render/frame_sums.hpp"

namespace pathscope {

/// Of one sample, summed over the pixels and channels of each block.
[[nodiscard]] std::vector<double> variance_of_blocks(const FrameSums& half0, const FrameSums& half1);

/// Over pixels and channels, of all samples of both halves.
[[nodiscard]] double mean_radiance(const FrameSums& half0, const FrameSums& half1);

}  // namespace pathscope
