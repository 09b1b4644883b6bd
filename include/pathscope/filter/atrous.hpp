#pragma once
/// Edge-avoiding à-trous wavelet filter: a wide mean over alike neighbours, by a few passes of 25 taps each.
///
///   c_{i+1}(p) = sum_q h(q - p) w_i(p,q) c_i(q) / sum_q h(q - p) w_i(p,q)       i = 0 .. levels - 1
///   q - p      = 2^i (dx, dy),  dx, dy in -2 .. 2;   h = b(dx) b(dy),  b = (1/16, 1/4, 3/8, 1/4, 1/16)
///   w_i(p,q)   = exp(-1/2 ( |c_i(p) - c_i(q)|^2 / (2^-i sigma_colour)^2
///                         + |n_p - n_q|^2       / sigma_normal^2
///                         + (ln z_p - ln z_q)^2 / sigma_depth^2
///                         + |a_p - a_q|^2       / sigma_albedo^2 ))
///
/// Why: b is the cubic B-spline. Its convolution with itself at twice the spacing is nearly a wider B-spline, so the taps
/// of level i can stand 2^i pixels apart, with holes (French: trous) between them. Five levels gather from 125 x 125 pixels
/// with 5 * 25 taps, where a square of that size has 15,625. On flat guides and with sigma_colour off, the result is exactly
/// the convolution of the levels' kernels. Guides and demodulation are those of the joint bilateral filter
/// (joint_bilateral.hpp), as is what happens to sky and to what is not a number. The colour is the one guide that changes
/// from pass to pass: each smooths it, so sigma_colour is halved with each level, and what the noise-free guides do not
/// show (a shadow) can still be kept where it stands out of the noise. It is off by default: at few samples a pixel differs
/// from its neighbours by noise, and a filter that respects differences respects noise.
/// Reach: 2 (2^levels - 1) pixels. A block filtered alone would need an apron of that width to look as in the assembled
/// picture, and servers have none: what is wider than a block stays different from block to block, and shows its seams.
/// Determinism: the same bits for any number of threads and any instruction set.
/// Source: Dammertz, Sewtz, Hanika & Lensch 2010, "Edge-Avoiding À-Trous Wavelet Transform for fast Global Illumination
///         Filtering"; Holschneider et al. 1989 (algorithme à trous).
/// Thread safety: yes.   Test: tests/filter/test_atrous.cpp

#include <limits>

#include "pathscope/core/result.hpp"
#include "pathscope/filter/joint_bilateral.hpp"
#include "pathscope/image/image.hpp"

namespace pathscope {

/// A sigma of infinity switches its term off.
struct AtrousParams {
    int levels = 5;                                               ///< 0 returns the picture unchanged.
    float sigma_colour = std::numeric_limits<float>::infinity();  ///< Of the first level, in linear radiance.
    float sigma_normal = 0.2f;                                    ///< The rest as in BilateralParams.
    float sigma_depth = 0.05f;
    float sigma_albedo = 0.1f;
    bool demodulate_albedo = false;

    friend bool operator==(const AtrousParams&, const AtrousParams&) = default;
};

inline constexpr int k_max_atrous_levels = 6;

/// How far the result of a pixel reaches, in pixels, in each of x and y.
[[nodiscard]] constexpr int atrous_reach(int levels) { return 2 * ((1 << levels) - 1); }

/// Whether these can be used: 0 <= levels <= k_max_atrous_levels, every sigma >= k_min_filter_sigma. The sentence of the
/// error names the parameter.
[[nodiscard]] Result<void> check_params(const AtrousParams& params);

/// Requires: check_params(params); guides as for joint_bilateral(). threads: 0 = all cores.
[[nodiscard]] Image atrous(const Image& noisy, const Guides& guides, const AtrousParams& params,
                           int threads = 0);

}  // namespace pathscope
