#pragma once
/// A picture and its guides as the kernel of a filter wants them (tap_kernels.hpp): planes of floats, with a margin.
///
///   guides   0..2 normal, 3 log depth, 4..6 albedo, each over its sigma, so that sums of squares are powers of two:
///            2^-|f_p - f_q|^2 = exp(-1/2 |..|^2 / sigma^2)
///   colours  three planes, or two sets of them where a filter works in passes; demodulated if asked for
///
/// The margin is as wide as the filter reaches. Its pixels, and those of the picture where anything is not a number, have
/// NaN as their first guide, so that every weight they are part of is zero, and black as their colour, because zero times
/// NaN would not be zero.
/// Thread safety: pixels may be set by several threads, each its own.   Test: tests/filter/test_joint_bilateral.cpp

#include <cstddef>

#include "filter/tap_kernels.hpp"
#include "pathscope/core/huge_pages.hpp"
#include "pathscope/filter/joint_bilateral.hpp"

namespace pathscope {

/// What parameters of all filters have in common. A sigma of infinity switches its guide off.
struct GuideUse {
    float sigma_normal, sigma_depth, sigma_albedo;
    bool demodulate_albedo;
};

/// What the colour of a pixel with this albedo is divided by before, and multiplied by after.
[[nodiscard]] Rgb demodulator(Rgb albedo);

/// 1 / (2 sigma^2 ln 2): what a squared distance is multiplied by, for its Gaussian to be 2^-product.
[[nodiscard]] float exponent_scale(float sigma);

/// Whether a depth says that there is no surface.
[[nodiscard]] bool is_background(float depth);

class Features {
  public:
    /// Requires: guides of the picture's size or empty; reach >= 0; colour_sets 1 or 2, of which the first is filled in.
    Features(const Image& noisy, const Guides& guides, const GuideUse& use, int reach, int colour_sets,
             int threads);
    ~Features();
    Features(const Features&) = delete;
    Features& operator=(const Features&) = delete;

    /// From a pixel to the one `dx` to the right of it and `dy` below, in floats.
    [[nodiscard]] std::ptrdiff_t offset(int dx, int dy) const {
        return std::ptrdiff_t(dy) * std::ptrdiff_t(stride_ * planes_) + dx;
    }
    [[nodiscard]] StripPlanes strip(int x, int y, int colour_set) const {
        const float* const first = values_ + place(x, y);
        return {first, first + first_colour(colour_set) * stride_, stride_};
    }
    void set_colour(int colour_set, int x, int y, Rgb colour) {
        float* const first = values_ + place(x, y) + first_colour(colour_set) * stride_;
        for (std::size_t k = 0; k < k_colour_planes; ++k) first[k * stride_] = colour[int(k)];
    }

  private:
    [[nodiscard]] std::size_t place(int x, int y) const {
        return std::size_t(y + reach_) * planes_ * stride_ + std::size_t(x + reach_);
    }
    [[nodiscard]] static std::size_t first_colour(int colour_set) {
        return k_guide_planes + std::size_t(colour_set) * k_colour_planes;
    }
    [[nodiscard]] std::size_t size() const { return std::size_t(height_ + 2 * reach_) * planes_ * stride_; }
    void clear_row(int y);

    int height_, reach_;
    std::size_t planes_, stride_;
    float*
        values_;  ///< From HugePageAllocator, and not set to zero by it: each thread sets the rows it fills in.
};

}  // namespace pathscope
