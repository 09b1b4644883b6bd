#pragma once
/// One pass of a filter over a picture, tile by tile.
///
/// Why tiles: a strip of k_strip pixels and the rows that its taps reach fit the innermost cache, and the strip below needs
/// all of those rows but one. So a thread walks down a column of strips.
/// Determinism: a pixel's mean depends on its own taps only, not on the tile or the thread.

#include <algorithm>
#include <vector>

#include "filter/features.hpp"
#include "filter/tap_kernels.hpp"
#include "pathscope/core/parallel_for.hpp"

namespace pathscope {

struct FilterPass {
    SumTaps sum_taps;
    std::vector<Tap> taps;
    float colour_scale = 0;
};

struct PixelMean {
    float weight;  ///< The sum of all weights; 0 where the pixel is not a number.
    Rgb colour;    ///< Undefined where weight is 0.
};

/// What the filtered picture shows of a mean. Weight is 0 only where a pixel is not a number, as all others count
/// themselves: such a one is copied through.
[[nodiscard]] inline Rgb filtered_colour(const PixelMean& mean, const Image& noisy, const Guides& guides,
                                         const GuideUse& use, int x, int y) {
    if (mean.weight == 0) return noisy.at(x, y);
    return use.demodulate_albedo ? mean.colour * demodulator(guides.albedo.at(x, y)) : mean.colour;
}

/// Calls use(x, y, mean) for each pixel of `frame`, from several threads.
template <class Use>
void for_each_mean(const Features& features, int colour_set, const FilterPass& pass, PixelRect frame,
                   int threads, Use&& use) {
    constexpr int k_rows = 32;
    const int columns = (frame.width + k_strip - 1) / k_strip, bands = (frame.height + k_rows - 1) / k_rows;
    parallel_for(std::int64_t(columns) * bands, threads, [&](int tile) {
        const int first_x = tile % columns * k_strip, first_y = tile / columns * k_rows;
        const int count = std::min(k_strip, frame.width - first_x);
        StripSums sums;
        for (int y = first_y; y < std::min(first_y + k_rows, frame.height); ++y) {
            pass.sum_taps(features.strip(first_x, y, colour_set), pass.taps, pass.colour_scale,
                          std::size_t(count), sums);
            for (std::size_t i = 0; i < std::size_t(count); ++i) {
                const Rgb colour{sums.colour[0][i], sums.colour[1][i], sums.colour[2][i]};
                use(first_x + int(i), y, PixelMean{sums.weight[i], colour / sums.weight[i]});
            }
        }
    });
}

}  // namespace pathscope
