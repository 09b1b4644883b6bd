#pragma once
/// The light of a frame as it grows: exact sums per pixel, samples per block.
///
///   mean(pixel) = quantum * sum(pixel) / samples(block of the pixel)
///
/// Why: rounds arrive in any order from anywhere, and sums are integers, so the image does not depend on that order.
/// Who may add which round is not decided here but in cluster/ledger.hpp.
/// Thread safety: one thread at a time.   Test: tests/render/test_frame_sums.cpp

#include <cstdint>
#include <span>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/image/block.hpp"
#include "pathscope/image/exact_sum.hpp"
#include "pathscope/image/image.hpp"

namespace pathscope {

class FrameSums {
  public:
    FrameSums() = default;
    FrameSums(const BlockGrid& grid, Quantum quantum);

    /// Sums from a file. An error unless there is one per pixel, each in_range for the samples of its block.
    /// Requires: a number of samples for each block.
    [[nodiscard]] static Result<FrameSums> restored(const BlockGrid& grid, Quantum quantum,
                                                    std::vector<PixelSum> sums,
                                                    std::vector<std::uint32_t> samples);

    /// Adds a round. Requires: grid().holds(round), one sum per pixel of the rect, each in_range for round.count, and
    /// the block's samples stay within k_max_samples_per_pixel.
    void add(const Round& round, std::span<const PixelSum> sums);

    /// Puts a block back to what it was. Requires: `to` is empty for black, or the sums of a whole frame, of which the block's
    /// are in_range for so many samples.
    void reset_block(std::uint32_t block, std::uint32_t samples, std::span<const PixelSum> to);

    [[nodiscard]] const BlockGrid& grid() const { return grid_; }
    [[nodiscard]] Quantum quantum() const { return quantum_; }
    [[nodiscard]] const PixelSum& sum_at(int x, int y) const {
        return sums_[std::size_t(y) * std::size_t(grid_.width()) + std::size_t(x)];
    }
    [[nodiscard]] std::span<const PixelSum> sums() const { return sums_; }  ///< Row by row.
    [[nodiscard]] std::uint32_t samples_of_block(std::uint32_t block) const { return samples_[block]; }
    [[nodiscard]] Image mean() const;  ///< Black where there is no sample.
    [[nodiscard]] Plane samples() const;

  private:
    BlockGrid grid_;
    Quantum quantum_;
    std::vector<PixelSum> sums_;
    std::vector<std::uint32_t> samples_;
};

}  // namespace pathscope
