#include "pathscope/render/frame_sums.hpp"

#include <fmt/format.h>

#include <utility>

namespace pathscope {

FrameSums::FrameSums(const BlockGrid& grid, Quantum quantum)
    : grid_(grid),
      quantum_(quantum),
      sums_(std::size_t(grid.width()) * std::size_t(grid.height())),
      samples_(grid.count(), 0) {}

Result<FrameSums> FrameSums::restored(const BlockGrid& grid, Quantum quantum, std::vector<PixelSum> sums,
                                      std::vector<std::uint32_t> samples) {
    CHECK(samples.size() == grid.count(), samples.size(), grid.count());
    FrameSums frame;
    frame.grid_ = grid;
    frame.quantum_ = quantum;
    frame.sums_ = std::move(sums);
    frame.samples_ = std::move(samples);
    if (frame.sums_.size() != std::size_t(grid.width()) * std::size_t(grid.height()))
        return bad_input(fmt::format("It has the sums of {} pixels, but the frame has {}x{}.",
                                     frame.sums_.size(), grid.width(), grid.height()));
    for (int y = 0; y < grid.height(); ++y)
        for (int x = 0; x < grid.width(); ++x)
            if (const auto n = frame.samples_[grid.block_at(x, y)]; !in_range(frame.sum_at(x, y), n))
                return bad_input(fmt::format(
                    "The sum of pixel ({}, {}) is beyond what its {} samples can add up to.", x, y, n));
    return frame;
}

void FrameSums::add(const Round& round, std::span<const PixelSum> sums) {
    CHECK(grid_.holds(round) && sums.size() == std::size_t(round.rect.area()), round.block, sums.size());
    CHECK(samples_[round.block] + round.count <= k_max_samples_per_pixel, samples_[round.block], round.count);
    samples_[round.block] += round.count;

    std::size_t next = 0;
    for (int y = round.rect.y; y < round.rect.y + round.rect.height; ++y) {
        PixelSum* pixel = &sums_[std::size_t(y) * std::size_t(grid_.width()) + std::size_t(round.rect.x)];
        for (int x = 0; x < round.rect.width; ++x) *pixel++ += sums[next++];
    }
}

void FrameSums::reset_block(std::uint32_t block, std::uint32_t samples, std::span<const PixelSum> to) {
    CHECK(to.empty() ? samples == 0 : to.size() == sums_.size(), to.size(), samples);
    samples_[block] = samples;
    const PixelRect rect = grid_.rect(block);
    for (int y = rect.y; y < rect.y + rect.height; ++y)
        for (int x = rect.x; x < rect.x + rect.width; ++x) {
            const std::size_t pixel = std::size_t(y) * std::size_t(grid_.width()) + std::size_t(x);
            sums_[pixel] = to.empty() ? PixelSum{} : to[pixel];
        }
}

Image FrameSums::mean() const {
    Image image(grid_.width(), grid_.height());
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const std::size_t pixel = std::size_t(y) * std::size_t(image.width) + std::size_t(x);
            image.pixels[pixel] = pathscope::mean(sums_[pixel], samples_[grid_.block_at(x, y)], quantum_);
        }
    return image;
}

Plane FrameSums::samples() const {
    Plane plane(grid_.width(), grid_.height());
    for (int y = 0; y < plane.height; ++y)
        for (int x = 0; x < plane.width; ++x) plane.at(x, y) = float(samples_[grid_.block_at(x, y)]);
    return plane;
}

}  // namespace pathscope
