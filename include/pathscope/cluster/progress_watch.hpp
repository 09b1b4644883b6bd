#pragma once
/// Alive but stuck: a server that answers heartbeats, holds leases, and gets nowhere.
///
///     still  = heartbeats' time in which it held leases and its counter did not rise
///     stuck  <=>  still >= max(5 s, 4 * mean time from lease to result)  and  at least 3 heartbeats say so
///
/// Why: a failure detector sees silence, and such a server is not silent: a render thread that hangs in a driver, a lock, a
/// disk that does not answer. Deadlines and second copies save its rounds one by one, but it is given the next ones
/// as if nothing were wrong; if it is the only one, for ever.
/// Why a counter and not results: an honest round may take minutes. Its counter rises all the while, so how slow a server
/// is does not matter. One that counts finished rounds only is judged by how long its rounds take: the mean.
/// Why heartbeats' time: a machine that was asleep, or parted from us, told nothing meanwhile, and is not
/// blamed for it. A gap between two heartbeats counts as two intervals at most.
/// No clock: `now` is an argument and never falls. Thread safety: one thread at a time.
/// Test: tests/cluster/test_progress_watch.cpp

#include <cstdint>

#include "pathscope/core/clock.hpp"

namespace pathscope {

class ProgressWatch {
  public:
    static constexpr TimeNs k_least_patience = 5 * k_second_ns;
    static constexpr int k_turnarounds = 4;
    static constexpr int k_least_beats = 3;

    /// heartbeat: how often it comes, at least.
    explicit ProgressWatch(TimeNs heartbeat) : heartbeat_(heartbeat) {}

    /// It beat: its counter, and how many leases it says it holds. A counter that fell is an old message.
    void on_heartbeat(std::uint64_t counter, std::uint32_t leases, TimeNs now);

    /// turnaround: mean time from lease to result so far, 0 if nothing has come yet.
    [[nodiscard]] bool stuck(TimeNs turnaround) const;

    /// How long it has stood still.
    [[nodiscard]] TimeNs still() const { return still_; }

  private:
    TimeNs heartbeat_;
    std::uint64_t counter_ = 0;
    TimeNs last_beat_ = 0;
    TimeNs still_ = 0;
    int beats_ = 0;  ///< Since it moved.
};

}  // namespace pathscope
