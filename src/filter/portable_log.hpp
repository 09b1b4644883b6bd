#pragma once
/// ln(z) with the same bits on every machine.
///
///   z = m 2^e,  m in [sqrt(1/2), sqrt(2))   =>   ln z = e ln 2 + 2 artanh(s),  s = (m - 1) / (m + 1)
///
/// with artanh(s) = s + s^3/3 + ... + s^15/15; |s| < 0.172.
///
/// Why: the C library picks its log() by what the CPU has (fused multiply-add or not), so two servers could filter the
/// same block to different last bits. This uses only additions, multiplications and divisions, which IEEE 754 rounds in
/// one way. There is no branch and no call: a picture takes one logarithm per pixel.
/// Requires: compiled with -ffp-contract=off.   Test: tests/filter/test_portable_log.cpp

#include <array>
#include <bit>
#include <cstdint>

namespace pathscope {

/// To within 1e-13 before it is rounded to float. Requires: z > 0 and finite.
[[nodiscard]] inline float portable_log(float z) {
    // As a double every float is normal, so that its exponent stands in its bits. Counted from sqrt(1/2), whose bits are
    // subtracted first, the exponent is e, and what is left of the bits is m.
    constexpr std::uint64_t k_root_half = std::bit_cast<std::uint64_t>(0.70710678118654752);
    constexpr std::uint64_t k_fraction = (std::uint64_t{1} << 52) - 1;
    const std::uint64_t above = std::bit_cast<std::uint64_t>(double(z)) - k_root_half;
    const auto e = static_cast<std::int32_t>(static_cast<std::int64_t>(above) >> 52);
    const double m = std::bit_cast<double>((above & k_fraction) + k_root_half);

    const double s = (m - 1) / (m + 1), s2 = s * s;
    double series = 1 / 15.0;
    for (const double term : std::array{1 / 13.0, 1 / 11.0, 1 / 9.0, 1 / 7.0, 1 / 5.0, 1 / 3.0, 1.0})
        series = series * s2 + term;
    return float(e * 0.69314718055994531 + 2 * s * series);
}

}  // namespace pathscope
