#pragma once
/// How far a picture is from a reference.
///
///   RMSE    sqrt(mean over pixels and channels of (a - b)^2)
///   relMSE  mean of (a - ref)^2 / (ref^2 + 0.01): errors count as eyes see them, in proportion
///   blocks  |A - R| / (R + 1 % of the mean of R), A and R means over 8x8 pixels: noise averages out, bias
///   stays z       (a - b) / sqrt(var_a / n_a + var_b / n_b): the difference in standard errors
///
/// Which: RMSE and relMSE rank noise; blocks compare with another renderer's picture; z asks whether two
/// noisy pictures have the same expectation. Requires of all: pictures of the same size, not empty.
/// Not-a-number in, not-a-number out. Sums run in double, row by row. Source: Rousselle et al. 2011,
/// "Adaptive sampling and reconstruction using greedy error minimization" (relMSE); Šidák 1967 (many
/// comparisons at once). Thread safety: yes.   Test: tests/image/test_metrics.cpp

#include <cstdint>

#include "pathscope/image/image.hpp"

namespace pathscope {

[[nodiscard]] double mean(const Image& image);  ///< Over pixels and channels.
[[nodiscard]] double rmse(const Image& a, const Image& b);

struct RelMseParams {
    double epsilon = 0.01;  ///< Keeps black pixels from deciding alone.
    double trimmed = 0;  ///< Fraction of the largest terms left out: fireflies have no mean to converge to.
};
[[nodiscard]] double rel_mse(const Image& image, const Image& reference, const RelMseParams& params = {});

/// Comparison with an independent renderer's image. Blocks count from the lower left corner, where a .pfm starts; the
/// columns on the right and rows at the top that fill no whole block are left out.
struct BlockComparison {
    double median = 0;  ///< Over blocks and channels.
    double percentile_95 = 0;
    double ratio_of_means = 0;  ///< mean(image) / mean(reference)

    /// The same picture, but for noise: median <= 2 %, 95th percentile <= 8 %, means within 1 %.
    [[nodiscard]] bool close() const;
};
[[nodiscard]] BlockComparison compare_blocks(const Image& image, const Image& reference, int block_size = 8);

/// The largest |z| over pixels and channels. var: variance of ONE sample, n: samples per pixel. Pixels
/// without variance give 0 when equal and infinity when not.
[[nodiscard]] double max_abs_z(const Image& mean_a, const Image& variance_a, std::uint32_t n_a,
                               const Image& mean_b, const Image& variance_b, std::uint32_t n_b);

/// The |z| that the largest of `comparisons` independent ones stays below with probability 1 - alpha, when
/// there is no difference (Šidák): P(|z| > limit) = 1 - (1 - alpha)^(1 / comparisons). Requires: comparisons
/// >= 1, 0 < alpha < 1. Assumes means of many samples: with few, or heavy tails, z is no normal variable.
[[nodiscard]] double sidak_z_limit(std::int64_t comparisons, double alpha);

}  // namespace pathscope
