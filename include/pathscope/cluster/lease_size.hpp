#pragma once
/// How many rounds of a unit one lease carries.
///
///     rounds = clamp(min(k_lease_time / time of one round, rounds that wait / (2 * places)), 1, ...)
///
/// Why more than one: a lease costs two messages, and the client some ten microseconds, however little is in it. A server
/// that is through with a round in half a millisecond would spend its client's time on mail; twenty milliseconds of work
/// are enough for a thousand servers.
/// Why no more: what is in one lease is late together, is lost together and comes back together. Towards the end of
/// a frame there is less for each place, so leases shrink, and all servers are through at about the same time. Half of
/// an even share is what each gets, as nobody knows how long it will take.
/// See: Polychronopoulos, Kuck 1987, "Guided self-scheduling"; Hummel, Schonberg, Flynn 1992, "Factoring".
/// Thread safety: values.   Test: tests/cluster/test_lease_size.cpp

#include <cstdint>
#include <optional>

#include "pathscope/core/clock.hpp"

namespace pathscope {

inline constexpr TimeNs k_lease_time = 20 * k_millisecond_ns;

/// lease_time: of work in one lease; 0 = one round each. round_time: nothing while it is not measured, then one round.
/// places: what the servers work on at once, and one lease more for each to go on with; at least 1.
[[nodiscard]] std::uint32_t rounds_per_lease(TimeNs lease_time, std::optional<TimeNs> round_time,
                                             std::uint64_t rounds_waiting, std::uint64_t places);

}  // namespace pathscope
