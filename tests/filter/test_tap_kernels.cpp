#include "../../src/filter/tap_kernels.hpp"

#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

constexpr int k_reach = 3, k_rows = 2 * k_reach + 1;
constexpr std::size_t k_stride = k_strip + 2 * k_reach + k_padding;
constexpr std::size_t k_planes = k_guide_planes + k_colour_planes;

/// One strip of pixels and all that its taps reach: alike guides, some far off, some that are not numbers.
struct Strip {
    std::vector<float> values = std::vector<float>(k_rows * k_planes * k_stride);
    std::vector<Tap> taps;

    explicit Strip(std::uint32_t seed) {
        HashRng rng(seed);
        for (float& value : values) {
            const float u = rng.next_float();
            value = u < 0.01f ? 30 * rng.next_float() : 0.7f * rng.next_float();
        }
        for (int row = 0; row < k_rows; ++row) {
            for (std::size_t x = 0; x < k_stride; ++x) {
                if (rng.next_float() > 0.05f) continue;
                value(row, 0, x) = std::numeric_limits<float>::quiet_NaN();
                for (std::size_t k = k_guide_planes; k < k_planes; ++k) value(row, k, x) = 0;
            }
        }
        for (int dy = -k_reach; dy <= k_reach; ++dy)
            for (int dx = -k_reach; dx <= k_reach; ++dx)
                taps.push_back({std::ptrdiff_t(dy) * std::ptrdiff_t(k_planes * k_stride) + dx,
                                0.1f * float(dx * dx + dy * dy)});
    }

    float& value(int row, std::size_t plane, std::size_t x) {
        return values[(std::size_t(row) * k_planes + plane) * k_stride + x];
    }
    [[nodiscard]] StripPlanes planes() const {
        const float* const first = &values[std::size_t(k_reach) * k_planes * k_stride + k_reach];
        return {first, first + k_guide_planes * k_stride, k_stride};
    }
};

/// The sums of one pixel from the equation, in double.
struct PixelSums {
    double weight = 0;
    std::array<double, k_colour_planes> colour{};
};

PixelSums sums_by_equation(const Strip& strip, float colour_scale, std::size_t i) {
    const StripPlanes planes = strip.planes();
    const auto squares = [&](const float* first, std::size_t count, std::ptrdiff_t offset) {
        double sum = 0;
        for (std::size_t k = 0; k < count; ++k) {
            const float* const own = first + k * planes.stride + i;
            sum += std::pow(double(own[offset]) - double(own[0]), 2);
        }
        return sum;
    };
    PixelSums sums;
    for (const Tap& tap : strip.taps) {
        const double exponent = double(tap.exponent) + squares(planes.guides, k_guide_planes, tap.offset) +
                                double(colour_scale) * squares(planes.colours, k_colour_planes, tap.offset);
        const double w = std::isnan(exponent) ? 0 : std::exp2(-exponent);
        sums.weight += w;
        for (std::size_t k = 0; k < k_colour_planes; ++k)
            sums.colour[k] += w * double((planes.colours + k * planes.stride + i)[tap.offset]);
    }
    return sums;
}

std::vector<SimdLevel> levels_of_this_machine() {
    std::vector<SimdLevel> levels;
    for (const auto& entry : k_simd_level_names)
        if (entry.value <= highest_simd_level()) levels.push_back(entry.value);
    return levels;
}

}  // namespace

TEST_CASE("the kernel sums what the equation says, at every level, with colours compared and not") {
    const Strip strip(1);
    for (const SimdLevel level : levels_of_this_machine()) {
        CAPTURE(std::string(name_of(level)));
        for (const float colour_scale : {0.0f, 2.5f}) {
            CAPTURE(colour_scale);
            const TapKernel& kernel = tap_kernel(level);
            StripSums sums;
            (colour_scale == 0 ? kernel.by_guides : kernel.by_guides_and_colour)(strip.planes(), strip.taps,
                                                                                 colour_scale, k_strip, sums);
            int alone = 0;
            for (std::size_t i = 0; i < k_strip; ++i) {
                const PixelSums expected = sums_by_equation(strip, colour_scale, i);
                alone += expected.weight == 0;
                CHECK(double(sums.weight[i]) == doctest::Approx(expected.weight).epsilon(3e-6));
                for (std::size_t k = 0; k < k_colour_planes; ++k)
                    CHECK(double(sums.colour[k][i]) == doctest::Approx(expected.colour[k]).epsilon(3e-6));
            }
            CHECK(alone > 0);
        }
    }
}

TEST_CASE("the bits are the same at every level and for any beginning and length of a strip") {
    const Strip strip(2);
    const auto bits = [](float a) { return std::bit_cast<std::uint32_t>(a); };
    StripSums whole;
    tap_kernel_portable().by_guides_and_colour(strip.planes(), strip.taps, 1.5f, k_strip, whole);
    for (const SimdLevel level : levels_of_this_machine()) {
        CAPTURE(std::string(name_of(level)));
        for (const std::size_t begin : {0, 1, 13, 31}) {
            for (const std::size_t count : {1, 7, 17, 19, 32}) {
                if (begin + count > k_strip) continue;
                StripPlanes planes = strip.planes();
                planes.guides += begin;
                planes.colours += begin;
                StripSums part;
                tap_kernel(level).by_guides_and_colour(planes, strip.taps, 1.5f, count, part);
                for (std::size_t i = 0; i < count; ++i) {
                    CHECK(bits(part.weight[i]) == bits(whole.weight[begin + i]));
                    for (std::size_t k = 0; k < k_colour_planes; ++k)
                        CHECK(bits(part.colour[k][i]) == bits(whole.colour[k][begin + i]));
                }
            }
        }
    }
}
