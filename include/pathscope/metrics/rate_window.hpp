#pragma once
/// How fast the counters rose lately.
///
///     rate(t) = (total(t) - total(s)) / (t - s),   s = the oldest moment kept, at most `window` before t
///
/// Why a window, and not the last two moments: tiles come in bunches, and a rate over less than a few of them is noise.
/// Memory: at most window / spacing + 1 moments. Units: per second.
/// No clock: `now` is an argument and never falls.   Thread safety: one thread at a time.
/// Test: tests/metrics/test_exposition.cpp

#include <deque>

#include "pathscope/core/clock.hpp"
#include "pathscope/probe/event_store.hpp"

namespace pathscope {

struct CounterRates {
    double rays = 0, samples = 0, tiles = 0;
};

class RateWindow {
  public:
    static constexpr TimeNs k_window = 10 * k_second_ns;
    static constexpr TimeNs k_spacing = k_second_ns / 4;

    /// Takes the totals of this moment, if the last one taken is long enough ago. Requires: none falls (totals_ever()).
    void add(const CounterTotals& totals, TimeNs now);

    /// Up to the last moment taken; zeros while there are fewer than two.
    [[nodiscard]] CounterRates rates() const;

  private:
    struct Moment {
        TimeNs time;
        CounterTotals totals;
    };
    std::deque<Moment> moments_;
};

}  // namespace pathscope
