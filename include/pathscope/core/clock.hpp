#pragma once
/// Time: nanoseconds on a monotonic clock, as a plain number.
///
/// Policies (ledger, schedules, detectors) never read a clock: `now` is an argument, so that tests and
/// simulations run in virtual time. Only sessions and programs call monotonic_now(). Thread safety: yes.

#include <cstdint>

namespace pathscope {

using TimeNs =
    std::int64_t;  ///< A point or a span in nanoseconds; the origin is arbitrary and the same in one process.

inline constexpr TimeNs k_microsecond_ns = 1'000;
inline constexpr TimeNs k_millisecond_ns = 1'000'000;
inline constexpr TimeNs k_second_ns = 1'000'000'000;

[[nodiscard]] TimeNs monotonic_now();

[[nodiscard]] constexpr double to_seconds(TimeNs span) { return static_cast<double>(span) * 1e-9; }
[[nodiscard]] constexpr double to_milliseconds(TimeNs span) { return static_cast<double>(span) * 1e-6; }
[[nodiscard]] constexpr TimeNs from_seconds(double seconds) { return static_cast<TimeNs>(seconds * 1e9); }

}  // namespace pathscope
