#pragma once
/// A renderer in virtual time: one round after the other, each with light that everybody can work out.
///
///     sum(pixel) = sum over samples of hash(seed of the state, part, pixel, sample)
///
/// So a sample that is lost, counted twice, taken from another state or written to another pixel changes the picture.

#include <deque>
#include <functional>
#include <set>

#include "pathscope/math/random.hpp"
#include "pathscope/session/round_runner.hpp"

#include "virtual_time.hpp"

namespace pathscope::testing {

[[nodiscard]] inline PixelSum light_of(std::uint32_t seed, LightPart part, int x, int y,
                                       std::uint32_t sample) {
    std::uint32_t hash = hash_combine(hash_u32(seed), std::uint32_t(part));
    hash = hash_combine(hash_combine(hash_combine(hash, std::uint32_t(x)), std::uint32_t(y)), sample);
    return {hash & 0xffff, hash >> 16, 1};
}

[[nodiscard]] inline RoundResult render_by_hash(const RoundJob& job, LightPart part) {
    RoundResult result;
    const PixelRect& rect = job.round.rect;
    for (int y = rect.y; y < rect.y + rect.height; ++y)
        for (int x = rect.x; x < rect.x + rect.width; ++x) {
            PixelSum sum;
            for (std::uint32_t s = job.round.first; s < job.round.first + job.round.count; ++s)
                sum += light_of(job.settings.seed, part, x, y, s);
            result.sums.push_back(sum);
        }
    result.samples = job.round.samples();
    result.rays = 3 * result.samples;
    return result;
}

class SimulatedRenderer {
  public:
    using Finish = std::function<void(RoundOutcome&)>;

    /// `finish` is called for each round, also for a cancelled one. samples_per_second: of pixels.
    SimulatedRenderer(VirtualTime& time, double samples_per_second, Finish finish)
        : time_(time), samples_per_second_(samples_per_second), finish_(std::move(finish)) {}

    void begin(RoundJob job) {
        queue_.push_back(std::move(job));
        if (queue_.size() == 1) run_first();
    }
    void cancel(std::uint64_t ticket) { cancelled_.insert(ticket); }
    /// Until then nothing is finished, and cancelling does not help.
    void hang(TimeNs until) {
        done_when_hung_ = work_done();
        hangs_until_ = std::max(hangs_until_, until);
    }
    [[nodiscard]] bool hangs() const { return time_.now() < hangs_until_; }

    /// Samples so far; stands still while it hangs.
    [[nodiscard]] std::uint64_t work_done() const {
        if (hangs()) return done_when_hung_;
        if (queue_.empty()) return finished_;
        const TimeNs worked = std::min(time_.now(), finish_at_) - begun_;
        return finished_ + std::uint64_t(to_seconds(worked) * samples_per_second_);
    }

    void cancel_all() {
        for (const RoundJob& job : queue_) cancel(job.ticket);
    }

  private:
    void run_first() {
        const TimeNs begun = time_.now();
        const RoundJob& job = queue_.front();
        const double samples = double(job.round.samples()) * (job.direct_too ? 2 : 1);
        const TimeNs took =
            cancelled_.contains(job.ticket) ? k_millisecond_ns : from_seconds(samples / samples_per_second_);
        begun_ = begun;
        finish_at_ = begun + took;
        time_.at(finish_at_, [this, begun, took] { finish_first(begun, took); });
    }
    void finish_first(TimeNs begun, TimeNs took) {
        if (hangs()) return time_.at(hangs_until_, [this, begun, took] { finish_first(begun, took); });
        const RoundJob job = std::move(queue_.front());
        queue_.pop_front();
        finished_ += job.round.samples() + 1;
        RoundOutcome outcome;
        outcome.ticket = job.ticket;
        outcome.part = job.part;
        outcome.round = job.round;
        outcome.started = begun;
        outcome.duration = took;
        if (cancelled_.erase(job.ticket) == 0) {
            outcome.result = render_by_hash(job, job.part);
            if (job.direct_too) outcome.direct = render_by_hash(job, LightPart::direct);
        }
        if (!queue_.empty()) run_first();
        finish_(outcome);
    }

    VirtualTime& time_;
    double samples_per_second_;
    Finish finish_;
    std::uint64_t finished_ = 0;  ///< In samples, and one for each round.
    TimeNs begun_ = 0, finish_at_ = 0;
    TimeNs hangs_until_ = 0;
    std::uint64_t done_when_hung_ = 0;
    std::deque<RoundJob> queue_;  ///< The first is being rendered.
    std::set<std::uint64_t> cancelled_;
};

}  // namespace pathscope::testing
