#pragma once
/// 2^-d with the same bits on every machine, for as many d as a register holds.
///
///   -d = n - g,  n whole and |g| <= 1/2   =>   2^-d = 2^n 2^-g,  2^-g = 1 + g p(g)
///
/// p has degree 4 and meets (2^-g - 1) / g at the Chebyshev points of [-1/2, 1/2]: the relative error stays below 2.1e-7,
/// and below 4e-7 with rounding. At g = 0 there is none: 2^0 is 1.
///
/// Why base 2: weights are exponentials of sums of squares, and whoever prepares the squares multiplies log2(e) in, once
/// per picture. Why not the C library's: portable_log.hpp.
/// Test: tests/filter/test_exp2_negative.cpp

#include "pathscope/math/simd.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

/// Requires: d >= 0, or NaN. Zero from d = 127, and for NaN. Between 126 and 127, where a float has no room for all bits
/// of the result, it is below 2^-126 and no more than that is promised.
[[nodiscard]] inline Floats exp2_negative(Floats distance) {
    const auto number = [](float a) { return broadcast_floats(a); };
    const Floats d = min(distance, number(127));  // Of NaN and 127, the second.
    const Floats round =
        number(0x1.8p23f);  // Adding it leaves no bits for a fraction: n lies in the last bits.
    const Floats shifted = round - d;
    const Floats g = d + (shifted - round);
    Floats p = number(-0.00133813021f);
    for (const float next : {0.00966636837f, -0.0555038117f, 0.240223497f, -0.693147182f})
        p = fused(g, p, number(next));
    return times_power_of_two(fused(g, p, number(1)), shifted);
}

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
