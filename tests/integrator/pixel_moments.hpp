#pragma once
/// Two ways to the same image: mean and variance of each pixel, and the z-test that compares them.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "pathscope/core/parallel_for.hpp"
#include "pathscope/math/vec.hpp"
#include "statistics.hpp"

namespace pathscope::testing {

inline std::array<double, 3> channels(Rgb c) { return {c.x, c.y, c.z}; }

using PixelMoments = std::array<Moments, 3>;

template <class Radiance>
std::vector<PixelMoments> picture(int size, int samples, Radiance&& radiance) {
    std::vector<PixelMoments> pixels(std::size_t(size * size));
    parallel_for(size * size, 0, [&](int i) {
        for (int sample = 0; sample < samples; ++sample) {
            const auto value = channels(radiance(i % size, i / size, std::uint32_t(sample)));
            for (std::size_t c = 0; c < 3; ++c) pixels[std::size_t(i)][c].add(value[c]);
        }
    });
    return pixels;
}

/// Least p over all pixels and channels that both pictures have the same mean, against Šidák's threshold.
inline bool same_mean(const std::vector<PixelMoments>& a, const std::vector<PixelMoments>& b) {
    double least_p = 1;
    for (std::size_t i = 0; i < a.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            const double error = std::hypot(a[i][c].standard_error(), b[i][c].standard_error());
            const double difference = a[i][c].mean() - b[i][c].mean();
            if (error == 0) {
                if (difference != 0) return false;
                continue;
            }
            least_p = std::min(least_p, normal_two_sided_p(difference / error));
        }
    return least_p > sidak_threshold(k_significance, int(3 * a.size()));
}

}  // namespace pathscope::testing
