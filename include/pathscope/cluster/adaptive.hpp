#pragma once
/// Adaptive rounds: samples where the error is, and an end when it is small enough, without bias.
///
///   picture   n_c samples per pixel of block c; their mean is the image
///   scout     2 x q samples per pixel, of two further sequences of random numbers; they decide, and are thrown away
///
///   v_c   = sum over pixels and channels of c of (h0 - h1)^2 q / 2,  h0 and h1 the means of the scout's two halves
///   error = sqrt(sum over c of v_c / n_c  /  channels of the frame)  /  mean of the scout's picture
///
/// Why without bias: every n_c, and whether there is a further pass, is a function of scouts alone, and those are
/// independent of the picture. So E[mean of the picture's samples | n_c] = E[sample], whatever n_c turned out to be. The
/// obvious rule, to let the picture's own samples decide, is biased: a pixel whose first samples happened to miss a small
/// bright light looks finished, is left alone and stays too dark, while one that was hit is diluted.
///
/// Passes: pass k brings the picture to a mean of round_samples 2^k samples, the scout to q = sqrt(that) / 4, so that the
/// scout's estimate gets better while its share of the work vanishes (1/8 at 16 samples, 1/64 at 1024). The last pass
/// fits the budget, scout included. Between passes the rounds of a pass are all committed, and the next is a function of
/// their exact sums: it does not depend on servers, schedule, threads or failures, so the image does not either. Blocks
/// are given whole rounds: of this image, and of no other, --block and --round are a part.
///
/// Who gets how many: the sum of v_c / n_c at a given number of samples is least where no round would lower it more per
/// sample elsewhere (Neyman 1934: n_c in proportion to the standard deviation per pixel). It is convex in each n_c, so
/// giving round after round to the block that gains most finds it. Half of the mean goes to every block whatever its
/// scout saw: it may have missed a small light.
///
/// The estimate takes the error to fall as 1 / sqrt(n). With --sampler sobol it falls faster where light is smooth: the
/// true error is then below the estimate. Rare bright samples that no scout met make it higher.
/// See:    Kirk & Arvo 1991, "Unbiased sampling techniques for image synthesis"; Neyman 1934, "On the two different
///         aspects of the representative method".
/// Units:  samples per pixel; radiance for errors, squared for variances. No clock, no socket.
/// Thread safety: pure.   Test: tests/cluster/test_adaptive.cpp, tests/session/test_adaptive_frame.cpp

#include <cstdint>
#include <span>

namespace pathscope {

struct SamplingRule {
    bool adaptive = false;    ///< Else all blocks get as many samples.
    double target_error = 0;  ///< Relative; 0 = none, go on until the budget is spent.

    /// Whether there are passes and scouts at all.
    [[nodiscard]] bool staged() const { return adaptive || target_error > 0; }
};

/// What a pass takes the frame to: samples per pixel since the beginning.
struct PassGoal {
    std::uint32_t picture = 0;  ///< On average over the frame.
    std::uint32_t scout = 0;    ///< In each of the scout's two halves, everywhere.
    bool last = false;          ///< The budget is spent with it.

    [[nodiscard]] std::uint32_t samples() const { return picture + 2 * scout; }
};

/// The least budget that gives each block a round of picture, and the scout that goes with it.
[[nodiscard]] std::uint32_t least_staged_budget(std::uint32_t round_samples);

/// Ensures: samples() <= budget; neither part falls from pass to pass; some pass is the last, and all after it are equal.
/// Requires: budget >= least_staged_budget(round_samples).
[[nodiscard]] PassGoal goal_of_pass(std::uint32_t pass, std::uint32_t budget, std::uint32_t round_samples);

/// A block as the scout saw it.
struct BlockNoise {
    double variance = 0;  ///< v_c: of one sample, summed over the block's pixels and channels.
    std::uint32_t pixels = 0;
};

struct RoundLimits {
    std::uint32_t round_samples = 1;
    std::uint32_t mean_samples = 1;  ///< Over the frame.
    std::uint32_t max_rounds = 1;    ///< Of one block.
};

/// Raises the rounds of each block until the mean is used up. A block without noise stays at half of the mean, and
/// what nobody needs is not spent. Requires: a noise for each block.
void allocate_rounds(std::span<std::uint32_t> rounds, std::span<const BlockNoise> noise,
                     const RoundLimits& limits);

/// What a part of the light adds to the squared error: v_c / n_c, summed over blocks. Infinite where a block has none.
[[nodiscard]] double summed_squared_error(std::span<const BlockNoise> noise,
                                          std::span<const std::uint32_t> samples);

/// Root mean square over pixels and channels, divided by the mean. 0 for a black frame without error.
[[nodiscard]] double relative_error(double summed_squared_error, double mean, std::uint64_t pixels);

}  // namespace pathscope
