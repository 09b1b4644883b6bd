#pragma once
/// How long a lease lasts, from how fast its server was so far.
///
///     duration = clamp(4 * predicted, 0.5 s, max(6 s, 2 * predicted)) * 2^attempts
///
/// Why 4: rounds of one image differ in cost, and a lease that ends too early only makes work twice. Why at least
/// half a second: a server may be stopped for a moment by its machine. Why an upper end: a stuck server holds a
/// round no longer than the classic system took to see a death. Why doubling: when every server is slower than
/// predicted, each lease would end early for ever; the attempts before this one say so.
/// Thread safety: values.   Test: tests/cluster/test_lease_policy.cpp

#include <cstdint>
#include <optional>

#include "pathscope/core/clock.hpp"

namespace pathscope {

/// A server's speed: work per second, as an exponentially weighted mean over its results.
class SpeedEstimate {
  public:
    /// Work in any unit that is the same for all servers (samples times pixels); seconds it took the server.
    /// Results without work or time are ignored.
    void add(double work, TimeNs duration);

    [[nodiscard]] bool measured() const { return per_second_ > 0; }
    [[nodiscard]] double per_second() const { return per_second_; }  ///< 0 until measured.

    /// How long that much work will take; nothing until measured.
    [[nodiscard]] std::optional<TimeNs> predict(double work) const;

  private:
    static constexpr double k_weight_of_newest = 0.25;
    double per_second_ = 0;
};

/// attempts: how often the round was granted before (Ledger::attempts). predicted: nothing = not known, then the
/// upper end. With credits, a server works its leases off one after the other: pass the sum of what it owes.
[[nodiscard]] TimeNs lease_duration(std::optional<TimeNs> predicted, std::uint32_t attempts);

}  // namespace pathscope
