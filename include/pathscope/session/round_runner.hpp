#pragma once
/// Rounds on a thread of their own: what a server does with its leases, and a client with its own share.
///
///     runner.begin({ticket, LightPart::indirect, round, scene, camera, settings});
///     for (RoundOutcome& outcome : runner.take_finished()) ...     // after the wake-up
///
/// One round at a time, its rows on `threads` threads; the others wait in order. Every round that was begun has exactly
/// one outcome, a cancelled one an empty one, within a row's time.
/// work_done() rises all the while that a round is in work; if it stands still, whoever renders is stuck.
/// A speed cap stretches each round to the time that it would take at so many samples per second: a slow machine, for
/// lessons and for scaling tests on few cores.
/// Thread safety: begin, cancel and take_finished from one thread.   Test: tests/session/test_round_runner.cpp

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pathscope/core/clock.hpp"
#include "pathscope/protocol/strategy.hpp"
#include "pathscope/render/round_renderer.hpp"
#include "pathscope/session/worker.hpp"

namespace pathscope {

struct RoundJob {
    std::uint64_t ticket = 0;  ///< The caller's name for it; unique among those not finished.
    LightPart part = LightPart::indirect;
    Round round;
    std::shared_ptr<const Scene> scene;
    Camera camera;
    RenderSettings settings;
    bool direct_too = false;               ///< Of the same round, beside `part`, which must be indirect.
    Strategy strategy = Strategy::blocks;  ///< Of the indirect part: with another one it is no light.
};

struct RoundOutcome {
    std::uint64_t ticket = 0;
    LightPart part = LightPart::indirect;
    Round round;
    std::optional<RoundResult> result;  ///< Nothing if it was cancelled or failed.
    std::optional<RoundResult> direct;  ///< Beside the result, if it was asked for too.
    std::string failure;                ///< Why it failed; empty if it did not.
    TimeNs started = 0;
    TimeNs duration = 0;
};

class RoundRunner {
  public:
    /// threads: 0 = all cores. samples_per_second: 0 = no cap. Requires: `wake` outlives the runner.
    /// before_round: called first thing of each round, on the thread that renders; what it takes, the round takes.
    RoundRunner(const WakePair& wake, int threads, double samples_per_second = 0,
                std::function<void()> before_round = {});
    ~RoundRunner();  ///< Cancels and waits.

    void begin(RoundJob job);
    void cancel(std::uint64_t ticket);
    void cancel_all();
    [[nodiscard]] std::vector<RoundOutcome> take_finished();

    [[nodiscard]] std::uint64_t work_done() const { return work_done_.load(std::memory_order_relaxed); }

    [[nodiscard]] std::size_t pending() const { return cancellations_.size(); }  ///< Begun and not taken.

  private:
    class Cancellation;

    void render(const RoundJob& job, const CancelFlag& cancelled, RoundOutcome& outcome);
    void wait_until(TimeNs moment, Cancellation& cancellation);
    [[nodiscard]] RoundOutcome run(const RoundJob& job, Cancellation& cancellation);

    int threads_;
    double samples_per_second_;
    std::function<void()> before_round_;
    WorkCounter work_done_{0};  ///< In samples, or what takes as long.
    std::map<std::uint64_t, std::shared_ptr<Cancellation>> cancellations_;
    Mailbox<RoundOutcome> finished_;
    Worker worker_;  // Last, so that it ends first.
};

}  // namespace pathscope
