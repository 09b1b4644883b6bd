#include "pathscope/session/round_runner.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>

#include "pathscope/render/tile_filter.hpp"

namespace pathscope {
namespace {

constexpr TimeNs k_modelled_step = 100 * k_millisecond_ns;

}  // namespace

/// A flag that render loops read cheaply, and that wakes whoever waits for time to pass.
class RoundRunner::Cancellation {
  public:
    void cancel() {
        {
            const std::lock_guard lock(mutex_);
            flag_.store(true, std::memory_order_relaxed);
        }
        changed_.notify_all();
    }

    [[nodiscard]] const CancelFlag& flag() const { return flag_; }

    /// Waits until then, or until cancelled.
    void wait_until(TimeNs moment) {
        std::unique_lock lock(mutex_);
        const auto left = std::chrono::nanoseconds(moment - monotonic_now());
        changed_.wait_for(lock, left, [this] { return flag_.load(std::memory_order_relaxed); });
    }

  private:
    CancelFlag flag_{false};
    std::mutex mutex_;
    std::condition_variable changed_;
};

RoundRunner::RoundRunner(const WakePair& wake, int threads, double samples_per_second,
                         std::function<void()> before_round)
    : threads_(threads),
      samples_per_second_(samples_per_second),
      before_round_(std::move(before_round)),
      finished_(wake) {}

RoundRunner::~RoundRunner() { cancel_all(); }

void RoundRunner::begin(RoundJob job) {
    auto cancellation = std::make_shared<Cancellation>();
    CHECK(cancellations_.emplace(job.ticket, cancellation).second, job.ticket);
    worker_.post([this, job = std::move(job), cancellation] { finished_.put(run(job, *cancellation)); });
}

void RoundRunner::cancel(std::uint64_t ticket) {
    if (const auto found = cancellations_.find(ticket); found != cancellations_.end())
        found->second->cancel();
}

void RoundRunner::cancel_all() {
    for (const auto& [ticket, cancellation] : cancellations_) cancellation->cancel();
}

std::vector<RoundOutcome> RoundRunner::take_finished() {
    std::vector<RoundOutcome> outcomes = finished_.take_all();
    for (const RoundOutcome& outcome : outcomes) cancellations_.erase(outcome.ticket);
    return outcomes;
}

void RoundRunner::render(const RoundJob& job, const CancelFlag& cancelled, RoundOutcome& outcome) {
    CHECK(!job.direct_too || job.part == LightPart::indirect, job.ticket);
    if (job.strategy == Strategy::flat && job.part == LightPart::indirect) {
        RoundResult& result = outcome.result.emplace();
        result.sums = flat_sums(job.round.rect, job.round.first, job.round.count);
        result.samples = job.round.samples();
        work_done_.fetch_add(result.samples, std::memory_order_relaxed);
        if (job.direct_too)
            outcome.direct = render_round(*job.scene, job.camera, job.settings, LightPart::direct, job.round,
                                          threads_, &cancelled);
        if (job.direct_too && !outcome.direct) outcome.result.reset();  // Cancelled.
        return;
    }
    if (job.direct_too) {
        auto both = render_both_parts(*job.scene, job.camera, job.settings, job.round, threads_, &cancelled,
                                      &work_done_);
        if (!both) return;
        outcome.result = std::move(both->indirect);
        outcome.direct = std::move(both->direct);
    } else {
        outcome.result = render_round(*job.scene, job.camera, job.settings, job.part, job.round, threads_,
                                      &cancelled, &work_done_);
    }
    if (outcome.result && job.part == LightPart::indirect && job.settings.filter == FilterPlace::server)
        outcome.result->sums =
            filter_tile(*job.scene, job.camera, job.settings, job.round, outcome.result->sums, threads_);
}

/// Of a slow machine that is modelled: it works all the while, and its counter says so.
void RoundRunner::wait_until(TimeNs moment, Cancellation& cancellation) {
    for (TimeNs now = monotonic_now(); now < moment && !cancellation.flag().load(); now = monotonic_now()) {
        cancellation.wait_until(std::min(moment, now + k_modelled_step));
        work_done_.fetch_add(1, std::memory_order_relaxed);
    }
}

RoundOutcome RoundRunner::run(const RoundJob& job, Cancellation& cancellation) {
    RoundOutcome outcome;
    outcome.ticket = job.ticket;
    outcome.part = job.part;
    outcome.round = job.round;
    outcome.started = monotonic_now();
    if (before_round_) before_round_();
    try {
        render(job, cancellation.flag(), outcome);
    } catch (const std::exception& error) {
        outcome.failure = error.what();  // Out of memory: nothing else here throws.
        outcome.result.reset();          // Half done, it may lack the filter.
        outcome.direct.reset();
    }
    if (outcome.result && samples_per_second_ > 0) {
        const std::uint64_t samples =
            outcome.result->samples + (outcome.direct ? outcome.direct->samples : 0);
        const double seconds = double(samples) / samples_per_second_;
        wait_until(outcome.started + from_seconds(seconds), cancellation);
        if (cancellation.flag().load()) {
            outcome.result.reset();
            outcome.direct.reset();
        }
    }
    outcome.duration = monotonic_now() - outcome.started;
    return outcome;
}

}  // namespace pathscope
