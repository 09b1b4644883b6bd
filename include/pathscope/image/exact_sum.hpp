#pragma once
/// Exact sums: the same image for any order, grouping or place of adding.
///
///   n_i  = nearest integer to L_i / q,  q = 2^exponent  (ties to even)
///   mean = q * (n_1 + n_2 + ... + n_N) / N
///
/// Why: (a + b) + c differs from a + (b + c) in floats; 16 partial sums added in two orders differ in 43.9 %
/// of all channels. Who adds first depends on how many servers there are, which of them died and how rounds
/// were cut. Sums of integers do not care, and a relay may add too. So each *sample* is rounded once, where
/// it is born, and from then on light is an integer.
///
/// Range:   a sample holds at most 2^43 - 1 quanta and a pixel 2^20 samples, so a sum stays below 2^63.
/// Error:   |mean - true mean of the samples| <= q / 2, besides the rounding of the result to float (2^-24 of
/// it).
///          With quantum_for, q / 2 is below 2^-32 of a typical pixel: 256 times finer than the float it ends in.
///          Only where the brightest emitter is over 2^8 times brighter than a typical pixel does it set q: then
///          q / 2 is below 2^-40 of that emitter.
/// Beyond:  a sample of more than 2^43 - 1 quanta (8 times the brightest emitter and 2,048 times a typical
/// pixel, at
///          least) is clamped to that, and `saturated` is set for the caller to count and report.
/// Units:   q is a radiance. Requires the CPU's rounding mode to be the default, nearest even.
/// Thread safety: values.   Test: tests/image/test_exact_sum.cpp

#include <bit>
#include <cmath>
#include <cstdint>

#include "pathscope/core/check.hpp"
#include "pathscope/image/block.hpp"
#include "pathscope/math/vec.hpp"

namespace pathscope {

inline constexpr std::int64_t k_max_quanta = (std::int64_t{1} << 43) - 1;  ///< Of one sample, in one channel.
static_assert(k_max_quanta <= INT64_MAX / std::int64_t{k_max_samples_per_pixel});

/// The step that radiance is rounded to: q = 2^exponent.
struct Quantum {
    int exponent = -32;

    /// Every float is representable as a double multiple of q within these.
    static constexpr int k_min_exponent = -200, k_max_exponent = 100;
    [[nodiscard]] constexpr bool valid() const {
        return exponent >= k_min_exponent && exponent <= k_max_exponent;
    }
    friend constexpr bool operator==(const Quantum&, const Quantum&) = default;
};

/// The smallest power of two >= max(typical * 2^-32, brightest * 2^-40); with no light at all, that of a
/// typical radiance of 1. Typical: what a mid-grey pixel of this scene has; brightest: the largest channel of
/// any emitter. Client and servers compute it from the same state, or the client sends it. Requires: both
/// finite and >= 0.
[[nodiscard]] Quantum quantum_for(float typical_radiance, float brightest_radiance);

/// Samples of one pixel, added up, in quanta.
struct PixelSum {
    std::int64_t r = 0, g = 0, b = 0;

    /// Requires: the samples of both together are at most k_max_samples_per_pixel, so that nothing overflows.
    constexpr PixelSum& operator+=(const PixelSum& other) {
        r += other.r;
        g += other.g;
        b += other.b;
        return *this;
    }
    friend constexpr PixelSum operator+(PixelSum sum, const PixelSum& other) { return sum += other; }
    friend constexpr bool operator==(const PixelSum&, const PixelSum&) = default;
};

namespace detail {

/// 2^exponent, put together from bits: std::ldexp is a library call, and this runs three times per sample.
[[nodiscard]] constexpr double power_of_two(int exponent) {
    return std::bit_cast<double>(std::uint64_t(1023 + exponent) << 52);
}

[[nodiscard]] inline std::int64_t quantise_channel(float radiance, double quanta_per_radiance,
                                                   bool& saturated) {
    CHECK(radiance >= 0 && radiance <= 0x1.fffffep127f, radiance);
    const double quanta = double(radiance) * quanta_per_radiance;  // Exact: only the exponent changes.
    if (quanta > double(k_max_quanta)) {
        saturated = true;
        return k_max_quanta;
    }
    return std::llrint(quanta);
}

}  // namespace detail

/// One sample in quanta. Sets `saturated` when a channel had to be clamped, and leaves it alone otherwise.
/// Requires: each channel finite and >= 0 (non-finite and negative radiance is dropped and counted before).
[[nodiscard]] inline PixelSum quantise(Rgb radiance, Quantum quantum, bool& saturated) {
    CHECK(quantum.valid(), quantum.exponent);
    const double scale = detail::power_of_two(-quantum.exponent);
    return {detail::quantise_channel(radiance.x, scale, saturated),
            detail::quantise_channel(radiance.y, scale, saturated),
            detail::quantise_channel(radiance.z, scale, saturated)};
}

/// Whether a sum of `count` samples can have come out of quantise(): ask this of sums from elsewhere before
/// adding them, since the bound is what keeps the addition from overflowing.
[[nodiscard]] constexpr bool in_range(const PixelSum& sum, std::uint32_t count) {
    if (count > k_max_samples_per_pixel) return false;
    const std::int64_t limit = k_max_quanta * std::int64_t{count};
    const auto ok = [limit](std::int64_t quanta) { return quanta >= 0 && quanta <= limit; };
    return ok(sum.r) && ok(sum.g) && ok(sum.b);
}

/// The mean radiance of `count` samples; black for count = 0. Computed in double, rounded to float once.
/// Requires: in_range(sum, count).
[[nodiscard]] inline Rgb mean(const PixelSum& sum, std::uint32_t count, Quantum quantum) {
    CHECK(quantum.valid() && in_range(sum, count), quantum.exponent, sum.r, sum.g, sum.b, count);
    if (count == 0) return {};
    const double scale = detail::power_of_two(quantum.exponent);
    const auto channel = [&](std::int64_t quanta) { return float(double(quanta) / double(count) * scale); };
    return {channel(sum.r), channel(sum.g), channel(sum.b)};
}

}  // namespace pathscope
