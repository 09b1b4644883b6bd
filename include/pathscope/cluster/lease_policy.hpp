#pragma once
/// How long a lease lasts, from how fast its server was so far.
///
///     duration = clamp(4 * predicted, 0.5 s, max(6 s, 2 * predicted)) * 2^min(attempts, 3), at most an hour
///
/// Why 4: rounds of one image differ in cost, and a lease that ends too early only makes work twice. Why at
/// least half a second: a machine may stop a process for a moment. Why an upper end: a stuck server holds a
/// round no longer than the classic system took to see a death. Why doubling: when every server is slower
/// than predicted, each lease would end early; the attempts before this one say so. Why not for long: a lease
/// whose message was lost is waited for just as long.
/// Thread safety: values.   Test: tests/cluster/test_lease_policy.cpp

#include <cstdint>
#include <optional>

#include "pathscope/core/clock.hpp"

namespace pathscope {

/// A server's speed, as an exponentially weighted mean over its results. The mean is taken of time per work,
/// not of work per time, because it is times that are predicted.
class SpeedEstimate {
  public:
    /// Work in any unit that is the same for all servers (samples times pixels), and how long it took the
    /// server. A result without work or time is ignored.
    void add(double work, TimeNs duration);

    [[nodiscard]] bool measured() const { return seconds_per_work_ > 0; }
    [[nodiscard]] double per_second() const { return measured() ? 1 / seconds_per_work_ : 0; }

    /// How long that much work will take; nothing until measured.
    [[nodiscard]] std::optional<TimeNs> predict(double work) const;

  private:
    double seconds_per_work_ = 0;
};

/// How long a server's leases take from grant to result, as a mean of the same weights. Beside rendering there is the
/// wire, and there are queues at both ends: with a thousand servers, results wait for a client that has its hands full,
/// and a lease that ended meanwhile would bring it the same work again.
class Turnaround {
  public:
    void add(TimeNs since_grant);
    [[nodiscard]] TimeNs mean() const { return TimeNs(mean_ns_); }  ///< 0 until measured.
    /// What one lease takes a server with no other to do: the mean, less what rendering the in_turn - 1 leases in front
    /// takes. The wire and the client take as long as ever, which an idle server does not save. Requires: in_turn >= 1.
    [[nodiscard]] TimeNs when_idle(TimeNs render_time, std::size_t in_turn) const;

  private:
    double mean_ns_ = 0;
};

/// predicted: nothing = not known, then the usual upper end. A server works its leases off one after the
/// other: pass the sum of what it owes. attempts: how often the round was granted before (Ledger::attempts).
[[nodiscard]] TimeNs lease_duration(std::optional<TimeNs> predicted, std::uint32_t attempts);

}  // namespace pathscope
