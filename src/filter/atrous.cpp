#include "pathscope/filter/atrous.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "filter/features.hpp"
#include "filter/filter_pass.hpp"
#include "filter/input_checks.hpp"

namespace pathscope {
namespace {

/// Five by five taps `hole` pixels apart.
std::vector<Tap> spline_taps(const Features& features, int hole) {
    // -log2 of 3/8, 1/4 and 1/16, as the kernel wants weights.
    constexpr std::array k_exponents{1.41503750f, 2.0f, 4.0f};
    std::vector<Tap> taps;
    for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx)
            taps.push_back({features.offset(hole * dx, hole * dy),
                            k_exponents[std::size_t(std::abs(dx))] + k_exponents[std::size_t(std::abs(dy))]});
    return taps;
}

FilterPass level_pass(const Features& features, const AtrousParams& params, int level) {
    const TapKernel& kernel = tap_kernel(simd_level());
    const bool by_colour = !std::isinf(params.sigma_colour);
    return {by_colour ? kernel.by_guides_and_colour : kernel.by_guides, spline_taps(features, 1 << level),
            exponent_scale(std::ldexp(params.sigma_colour, -level))};
}

}  // namespace

Result<void> check_params(const AtrousParams& params) {
    if (params.levels < 0 || params.levels > k_max_atrous_levels)
        return bad_input(fmt::format("{} filter levels are not possible: there are 0 to {}.", params.levels,
                                     k_max_atrous_levels));
    return check_sigmas({{"colour", params.sigma_colour},
                         {"normal", params.sigma_normal},
                         {"depth", params.sigma_depth},
                         {"albedo", params.sigma_albedo}});
}

Image atrous(const Image& noisy, const Guides& guides, const AtrousParams& params, int threads) {
    check_inputs(noisy, guides, params);
    if (params.levels == 0 || noisy.empty()) return noisy;

    const GuideUse use{params.sigma_normal, params.sigma_depth, params.sigma_albedo,
                       params.demodulate_albedo};
    const int last = params.levels - 1;
    Features features(noisy, guides, use, 2 << last, 2, threads);
    // Each level reads one set of colours and fills in the other. A pixel that is not a number stays black in both.
    for (int level = 0; level < last; ++level) {
        const int from = level % 2, to = 1 - from;
        for_each_mean(features, from, level_pass(features, params, level), noisy.rect(), threads,
                      [&](int x, int y, const PixelMean& mean) {
                          if (mean.weight > 0) features.set_colour(to, x, y, mean.colour);
                      });
    }
    Image filtered(noisy.width, noisy.height);
    for_each_mean(features, last % 2, level_pass(features, params, last), noisy.rect(), threads,
                  [&](int x, int y, const PixelMean& mean) {
                      filtered.at(x, y) = filtered_colour(mean, noisy, guides, use, x, y);
                  });
    return filtered;
}

}  // namespace pathscope
