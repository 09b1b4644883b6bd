#pragma once
/// exp(-d) and ln(z) with the same bits on every machine.
///
/// Why: the C library picks its exp() by what the CPU has (fused multiply-add or not), so two servers could filter the
/// same block to different last bits. These use only additions, multiplications and divisions, which IEEE 754 rounds
/// in one way. exp_negative has no branch and no call, so that compilers turn loops around it into vector code.
/// Requires: compiled with -ffp-contract=off.   Test: tests/filter/test_exp_log.cpp

#include <bit>
#include <cmath>
#include <cstdint>

namespace pathscope {

/// Neighbours this far away in the exponent have no weight: exp(-80) is 2e-35.
inline constexpr float k_exp_cutoff = 80;

/// exp(-d) for 0 <= d < k_exp_cutoff, relative error below 3e-7, and 1 at d = 0; zero for larger d and for NaN.
///
///   -d = n ln 2 + g,  n whole and |g| <= ln(2) / 2   =>   exp(-d) = 2^n exp(g)
///
/// exp(g) is its Taylor series up to g^6, whose next term is below 1.2e-7. ln 2 is subtracted in two parts, the first
/// with so few bits that n times it is exact (Cody & Waite 1980).
[[nodiscard]] inline float exp_negative(float d) {
    constexpr float k_log2_e = 1.44269504f;
    constexpr float k_ln2_high = 0.693359375f, k_ln2_low = -2.12194440e-4f;
    constexpr float k_round = 0x1.8p23f;  // Adding it leaves no bits for a fraction: n lies in the last bits.

    const float x = -d;
    const float shifted = x * k_log2_e + k_round;
    const float n = shifted - k_round;
    const float g = (x - n * k_ln2_high) - n * k_ln2_low;
    const float series =
        1 + g * (1 + g * (1 / 2.0f) *
                         (1 + g * (1 / 3.0f) *
                                  (1 + g * (1 / 4.0f) * (1 + g * (1 / 5.0f) * (1 + g * (1 / 6.0f))))));
    // Adding n to the exponent of the float multiplies by 2^n.
    const std::uint32_t power = std::bit_cast<std::uint32_t>(shifted) << 23;
    // Outside of its range the result is masked out, not branched around: float code that a branch skips is not
    // turned into vector code, as it might raise flags that the branch would have spared.
    const std::uint32_t keep = d < k_exp_cutoff ? ~0u : 0u;  // NaN is not less.
    return std::bit_cast<float>((std::bit_cast<std::uint32_t>(series) + power) & keep);
}

/// ln(z), z > 0 and finite, to within 1e-13 before it is rounded to float.
///
///   z = m 2^e,  m in [sqrt(1/2), sqrt(2))   =>   ln z = e ln 2 + 2 artanh(s),  s = (m - 1) / (m + 1)
///
/// with artanh(s) = s + s^3/3 + ... + s^15/15; |s| < 0.172.
[[nodiscard]] inline float portable_log(float z) {
    int e = 0;
    double m = std::frexp(double(z), &e);  // Takes bits apart, rounds nothing.
    if (m < 0.70710678118654752) {
        m *= 2;
        --e;
    }
    const double s = (m - 1) / (m + 1);
    double series = 0;
    for (int k = 15; k >= 1; k -= 2) series = series * (s * s) + 1.0 / k;
    return float(e * 0.69314718055994531 + 2 * s * series);
}

}  // namespace pathscope
