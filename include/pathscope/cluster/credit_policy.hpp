#pragma once
/// How many rounds a server is given at once.
///
///     window = clamp(at_once + ceil(round trip / time of one round), at_once + 1, k_most_credits)
///
///     client   lease 3 ----.                         ,---- lease 4
///                           \                       /
///     server   [ round 1 ]   [ round 2 ]  [ round 3 ]          what is rendered during a round trip has to lie there already
///
/// Why: with two, one in work and one waiting, a server never waits on a fast wire; on a slow one it does, for most of
/// its time. What it owes beyond that only comes back late when it dies, and is missing elsewhere at the end of a frame.
/// A relay works on many leases side by side, at_once of them, and a round's time is then what it adds to the time of all.
/// The round trip is the shortest of late: queues in between must not ask for more of what fills them.
///
/// All servers together owe no more results than fit into k_owed_bytes, for all of them may answer at once; a result has 24
/// bytes for each pixel before it is packed. Of what is beyond the least, one of n servers owes its n-th of k_shared_bytes:
/// a thousand that are quicker than their wire would else fill the client's queues, and what waits there is neither on
/// a wire nor in work. With blocks of the usual size and tens of servers, neither bounds anything.
/// Thread safety: values.   See: Little 1961, "A proof for the queuing formula: L = lambda W".
/// Test: tests/cluster/test_credit_policy.cpp

#include <cstddef>
#include <cstdint>
#include <optional>

#include "pathscope/core/clock.hpp"

namespace pathscope {

inline constexpr std::size_t k_least_credits = 2;
inline constexpr std::size_t k_most_credits = 64;
inline constexpr std::uint64_t k_owed_bytes = 256u << 20;
inline constexpr std::uint64_t k_shared_bytes = 32u << 20;

/// Either is nothing while it is not measured: then the window is the least. Requires: at_once >= 1.
[[nodiscard]] std::size_t credit_window(std::optional<TimeNs> round_trip, std::optional<TimeNs> round_time,
                                        std::size_t at_once = 1);

/// The most that one of so many servers shall owe. Requires: servers > 0.
[[nodiscard]] std::size_t credit_share(std::uint64_t result_bytes, std::size_t servers);

/// The most leases outstanding at once, over all servers: at least one.
[[nodiscard]] std::size_t most_leases(std::uint64_t result_bytes);

}  // namespace pathscope
