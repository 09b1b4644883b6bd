#pragma once
/// What a frame holds at a moment when no round is half done: enough to go on from, and nothing that follows from it.
///
///     samples of a block = samples of the rounds that its units have committed      (so they are not kept)
///     rounds a pass opens = those of the picture, block by block, and the scout's   (the scout's follow from the pass)
///
/// Leases are not kept: who held one is gone, or will have to ask again. Their rounds are open.
/// With passes the noise is that of the last finished one: the estimate of the error needs it until the next is
/// finished, and the scouts have grown since.
/// Memory: 24 bytes per pixel and part that is asked for, three times that with passes.
/// Thread safety: values.   Test: tests/session/test_checkpoint.cpp

#include <array>
#include <cstdint>
#include <vector>

#include "pathscope/cluster/ledger.hpp"
#include "pathscope/image/exact_sum.hpp"

namespace pathscope {

/// The picture, and the two halves of the scout: each a sequence of random numbers of its own.
inline constexpr std::uint32_t k_groups = 3;

/// Of one part of the light. Empty if it is not asked for.
struct PartSnapshot {
    std::uint32_t samples = 0;  ///< The budget, per pixel: it decides how long the last round of a unit is.
    std::vector<UnitSnapshot> units;
    std::vector<PixelSum> sums;  ///< Row by row.
    // With passes.
    std::vector<std::uint32_t> rounds;            ///< Opened for the picture, by block.
    std::array<std::vector<PixelSum>, 2> scouts;  ///< As `sums`.
    std::vector<double> variance;                 ///< Of blocks; empty before the first pass is finished.
    double mean = 0;                              ///< Radiance, as the scouts saw it.
};

/// Units of a part's ledger: the picture's blocks, and with passes those of both halves of the scout.
[[nodiscard]] constexpr std::size_t units_of_frame(std::uint32_t blocks, bool staged) {
    return std::size_t{blocks} * (staged ? k_groups : 1);
}

struct FrameSnapshot {
    std::uint32_t passes_finished = 0;
    bool last_pass_finished = false;
    PartSnapshot direct, indirect;
};

}  // namespace pathscope
