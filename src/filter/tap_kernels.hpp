#pragma once
/// The sums of a filter over its taps: the one loop that takes all the time.
///
///   W(p) = sum over taps t of w(p, p + t),   C(p) = sum of w(p, p + t) c(p + t)
///   w(p,q) = 2^-(e_t + sum over guides of (f_p - f_q)^2 + s sum over colours of (c_p - c_q)^2)
///
/// A tap is a neighbour's place relative to the pixel, and its price e_t. So one kernel serves every filter whose weights
/// are Gaussians: a square of neighbours, or five by five with holes between them.
///
/// Why like this: neighbouring pixels stand in the lanes of a register, their taps are added one after the other in the
/// order of the list, and the sums never leave their registers. No lane sees another, so that a pixel's bits do not depend
/// on how many lanes there are, where a strip begins, or which instructions are used; and padding (Features) makes a load
/// beyond the picture as good as any, so that there are no masks and no branches. Sums and products are fused: a tap is one
/// long chain, square upon square and then the powers of an exponential, and to halve the chain is to go half as fast again.
/// A processor that cannot fuse (before AVX2) takes twenty times as long for the same bits.
/// Test: tests/filter/test_tap_kernels.cpp

#include <array>
#include <cstddef>
#include <span>

#include "pathscope/math/simd_level.hpp"

namespace pathscope {

inline constexpr std::size_t k_guide_planes = 7;
inline constexpr std::size_t k_colour_planes = 3;

struct Tap {
    std::ptrdiff_t offset;  ///< From a pixel to this neighbour, in floats.
    float exponent;         ///< The weight that its place alone gives is 2^-exponent.
};

/// Where the planes of a strip of pixels lie: plane k of pixel i is first[k * stride + i].
struct StripPlanes {
    const float* guides;
    const float* colours;
    std::size_t stride;
};

/// Pixels whose sums are taken in one call: with all planes of the neighbours of a radius of 7 they take 38 KiB, and stay in
/// the innermost cache while a thread walks down.
inline constexpr int k_strip = 32;

struct StripSums {
    alignas(64) std::array<float, k_strip> weight;
    alignas(64) std::array<std::array<float, k_strip>, k_colour_planes> colour;
};

/// Fills in the sums of the first `count` pixels, and of some more until registers are full.
/// Requires: 0 < count <= k_strip; k_padding floats may be read after those of the last pixel.
using SumTaps = void (*)(const StripPlanes& planes, std::span<const Tap> taps, float colour_scale,
                         std::size_t count, StripSums& sums);
inline constexpr int k_padding = 16;

struct TapKernel {
    SumTaps by_guides;             ///< Colours have no say; colour_scale is ignored.
    SumTaps by_guides_and_colour;  ///< colour_scale is s.
};

/// Requires: level <= highest_simd_level().
[[nodiscard]] const TapKernel& tap_kernel(SimdLevel level);

[[nodiscard]] const TapKernel& tap_kernel_portable();
[[nodiscard]] const TapKernel& tap_kernel_avx2();
[[nodiscard]] const TapKernel& tap_kernel_avx512();

}  // namespace pathscope
