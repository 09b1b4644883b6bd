#pragma once
/// Clock offset: where a server's moments lie on the client's time line, and how surely.
///
///     client   t0 ------------------------------ t3         offset = ((t1 - t0) + (t2 - t3)) / 2
///                 \                            /            rtt    = (t3 - t0) - (t2 - t1)
///     server        t1 --- (thinks) --- t2                  |true offset - offset| <= rtt / 2
///
/// The midpoint is right if both ways take equally long, and wrong by at most half the round trip: the error
/// band. Queues only ever lengthen round trips, so the shortest one in the window says most; it ages by what
/// two quartz clocks may drift apart (100 ppm).
/// Units: nanoseconds; server time = client time + offset. Thread safety: one thread at a time.
/// See: Mills 1991, "Internet time synchronization: the network time protocol" (clock filter).
/// Test: tests/cluster/test_clock_offset.cpp

#include <array>
#include <cstddef>
#include <optional>

#include "pathscope/core/clock.hpp"

namespace pathscope {

/// Beyond 73 years a clock is a lie, and sums of such moments would overflow: what a peer says is asked for this first.
[[nodiscard]] constexpr bool is_plausible(TimeNs time) {
    return time >= -(TimeNs{1} << 61) && time <= TimeNs{1} << 61;
}

struct ClockExchange {
    TimeNs sent = 0;      ///< t0, client clock.
    TimeNs received = 0;  ///< t1, server clock.
    TimeNs answered = 0;  ///< t2, server clock.
    TimeNs returned = 0;  ///< t3, client clock.
};

struct ClockOffset {
    TimeNs offset = 0;  ///< Server clock minus client clock.
    TimeNs error = 0;   ///< The true offset lies within offset +- error.
    TimeNs rtt = 0;     ///< Of the exchange that says so.

    /// Requires: is_plausible(server_time).
    [[nodiscard]] TimeNs to_client(TimeNs server_time) const { return server_time - offset; }
};

class ClockEstimate {
  public:
    static constexpr std::size_t k_window = 64;
    static constexpr double k_drift = 100e-6;  ///< Seconds per second.

    /// Takes one exchange. Returns its round trip, or nothing if it cannot have happened (a peer that lies or
    /// answers twice): then it is ignored.
    std::optional<TimeNs> add(const ClockExchange& exchange);

    /// Nothing until the first exchange.
    [[nodiscard]] std::optional<ClockOffset> at(TimeNs now) const;

  private:
    struct Entry {
        TimeNs offset, rtt, taken;
    };
    std::array<Entry, k_window> entries_{};
    std::size_t seen_ = 0;
};

}  // namespace pathscope
