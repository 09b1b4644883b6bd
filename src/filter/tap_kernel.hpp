#pragma once
/// The loop of tap_kernels.hpp. Included by one source file for each instruction set, after that file has chosen it:
/// tap_portable.cpp, tap_avx2.cpp, tap_avx512.cpp.

#include "filter/exp2_negative.hpp"
#include "filter/tap_kernels.hpp"
#include "pathscope/math/simd.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

enum class Compare { guides, guides_and_colour };

/// The sum of squares between own values and those of a neighbour, added to `distance` plane by plane.
template <std::size_t planes>
[[nodiscard]] inline Floats add_squares(Floats distance, const std::array<Floats, planes>& own,
                                        const float* other, std::size_t stride) {
    for (std::size_t k = 0; k < planes; ++k) {
        const Floats difference = load_floats(other + k * stride) - own[k];
        distance = fused(difference, difference, distance);
    }
    return distance;
}

template <std::size_t planes>
[[nodiscard]] inline std::array<Floats, planes> load_planes(const float* first, std::size_t stride) {
    std::array<Floats, planes> values;
    for (std::size_t k = 0; k < planes; ++k) values[k] = load_floats(first + k * stride);
    return values;
}

/// One register of pixels, from pixel i of the strip on.
template <Compare compare>
inline void sum_taps_at(const StripPlanes& planes, std::span<const Tap> taps, float colour_scale,
                        std::size_t i, StripSums& sums) {
    const float* const guides = planes.guides + i;
    const float* const colours = planes.colours + i;
    const auto own_guides = load_planes<k_guide_planes>(guides, planes.stride);
    const auto own_colours = load_planes<k_colour_planes>(colours, planes.stride);
    const Floats zero = broadcast_floats(0), scale = broadcast_floats(colour_scale);

    Floats weight = zero;
    std::array<Floats, k_colour_planes> colour{zero, zero, zero};
    for (const Tap& tap : taps) {
        const float* const other_colours = colours + tap.offset;
        Floats distance =
            add_squares(broadcast_floats(tap.exponent), own_guides, guides + tap.offset, planes.stride);
        if constexpr (compare == Compare::guides_and_colour)
            distance = fused(scale, add_squares(zero, own_colours, other_colours, planes.stride), distance);
        const Floats w = exp2_negative(distance);
        weight = weight + w;
        for (std::size_t k = 0; k < k_colour_planes; ++k)
            colour[k] = fused(w, load_floats(other_colours + k * planes.stride), colour[k]);
    }
    store_floats(&sums.weight[i], weight);
    for (std::size_t k = 0; k < k_colour_planes; ++k) store_floats(&sums.colour[k][i], colour[k]);
}

template <Compare compare>
void sum_taps(const StripPlanes& planes, std::span<const Tap> taps, float colour_scale, std::size_t count,
              StripSums& sums) {
    for (std::size_t i = 0; i < count; i += k_floats)
        sum_taps_at<compare>(planes, taps, colour_scale, i, sums);
}

inline constexpr TapKernel k_tap_kernel{sum_taps<Compare::guides>, sum_taps<Compare::guides_and_colour>};

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
