#pragma once
/// a b + c rounded once, with the same bits on machines that have an instruction for it and on those that have not.
///
///   p = a b            exact: 24 bits times 24 bits fit the 53 of a double
///   s = p + c          rounded to 53 bits;  e = p + c - s is what that lost, and is exact too (Knuth's TwoSum)
///   t = s rounded to odd: where e != 0, of the two doubles around p + c the one whose last bit is 1
///   result = t rounded to 24 bits
///
/// Why not (float)s: where s fell on the middle between two floats, the second rounding no longer knows which side p + c
/// was on. The last bit of t remembers it, being 1 wherever something was lost, and a middle has a last bit of 0.
/// Why not std::fma everywhere: without the instruction the C library switches rounding modes, which takes far longer.
/// Requires: compiled with -ffp-contract=off.
/// See:   Boldo & Melquiond 2008, "Emulation of a FMA and Correctly Rounded Sums: Proved Algorithms Using Rounding to Odd".
/// Test:  tests/math/test_fused.cpp

#include <bit>
#include <cmath>
#include <cstdint>

namespace pathscope {

[[nodiscard]] inline float fused_multiply_add(float a, float b, float c) {
#if defined(__FP_FAST_FMAF)
    return std::fma(a, b, c);
#else
    const double p = double(a) * double(b), wide_c = double(c);
    const double s = p + wide_c;
    const double c_in_s = s - p;
    const double e = (p - (s - c_in_s)) + (wide_c - c_in_s);
    // No branches: whether something is lost is a toss of a coin. Nothing is where s is infinite or NaN, as e is NaN then.
    const auto bits = std::bit_cast<std::uint64_t>(s);
    const std::uint64_t lost = e < 0 || e > 0 ? 1 : 0;
    const std::uint64_t s_is_even = lost & ~bits;
    const std::uint64_t s_is_beyond = (std::bit_cast<std::uint64_t>(e) ^ bits) >> 63;  // |s| > |p + c|
    return float(std::bit_cast<double>(bits + s_is_even - 2 * (s_is_even & s_is_beyond)));
#endif
}

}  // namespace pathscope
