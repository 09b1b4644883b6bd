#pragma once
/// One ghost of a GhostHost: a server's state machine, its two sockets, and a renderer that is a clock.

#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "pathscope/net/context.hpp"
#include "pathscope/net/crowd_poller.hpp"
#include "pathscope/net/dealer.hpp"
#include "pathscope/session/ghost_host.hpp"
#include "pathscope/session/server_machine.hpp"

namespace pathscope {

/// Rounds one after the other, each as long as a machine of that speed needs. A machine does not wait for us to look: the
/// next round of its queue begins when the one before ends, not when that is noticed.
class ModelledRenderer {
  public:
    explicit ModelledRenderer(double samples_per_second) : samples_per_second_(samples_per_second) {}

    void begin(const RoundJob& job, TimeNs now);
    void cancel(std::uint64_t ticket);
    void cancel_all();

    /// Samples of all rounds, as far as they have come by then.
    [[nodiscard]] std::uint64_t work_done(TimeNs now) const;

    /// When the next outcome is due.
    [[nodiscard]] std::optional<TimeNs> next() const;
    /// Requires: next() is at or before now.
    [[nodiscard]] RoundOutcome take(TimeNs now);

  private:
    struct Queued {
        std::uint64_t ticket = 0;
        LightPart part = LightPart::indirect;
        Round round;
        TimeNs started = 0, done = 0;
        bool cancelled = false;
    };
    [[nodiscard]] static RoundOutcome outcome_of(const Queued& queued);

    double samples_per_second_;
    TimeNs free_at_ = 0;
    std::uint64_t finished_ = 0;  ///< Samples.
    std::deque<Queued> queue_;    ///< By rising `done`.
};

class GhostHost::Ghost : private ServerWorld {
  public:
    /// key: its sockets stir under key and key + 1.
    Ghost(const Context& context, CrowdPoller& poller, const GhostConfig& config, int number,
          double samples_per_second, std::uint64_t key);
    ~Ghost() override;

    /// New sockets. Requires: the machine is not linked.
    [[nodiscard]] Result<void> dial();

    /// One of its sockets may have something.
    void stir(Channel channel) { stirred_[channel == Channel::frames] = true; }

    /// Takes in what arrived, finishes rounds, does what is due; until nothing is left to do now.
    void tend();

    /// Closes the sockets.
    void unlink();

    /// Gives back what is in work, and says goodbye.
    void leave();

    [[nodiscard]] TimeNs next_timer(TimeNs now) const;
    [[nodiscard]] const ServerMachine& machine() const { return machine_; }

    TimeNs planned = 0;  ///< When the host will look again.

  private:
    struct Link {
        DealerSocket monitor, frames;
    };

    bool receive_next();
    void work();
    [[nodiscard]] DealerSocket& socket_of(Channel channel) {
        return channel == Channel::monitor ? link_->monitor : link_->frames;
    }

    // The world, as the machine sees it.
    bool send(Channel channel, Frames&& frames) override;
    void fill_tile(message::Tile& tile, const RoundResult& result, WireFormat format) const override;
    void begin(RoundJob job) override { renderer_.begin(job, monotonic_now()); }
    void cancel(std::uint64_t ticket) override { renderer_.cancel(ticket); }
    void cancel_all() override { renderer_.cancel_all(); }
    [[nodiscard]] std::uint64_t work_done() const override { return renderer_.work_done(monotonic_now()); }
    void load(RenderState state, Manifest) override { to_load_ = std::move(state); }
    [[nodiscard]] bool reads_files() const override { return false; }

    const Context& context_;
    CrowdPoller& poller_;
    std::array<std::string, 2> endpoints_;  ///< Of monitor and frames.
    std::uint64_t key_;
    std::optional<Link> link_;
    std::array<bool, 2> stirred_{};  ///< Monitor, frames: receive until nothing is left.
    std::optional<RenderState> to_load_;
    ServerMachine machine_;
    ModelledRenderer renderer_;
};

}  // namespace pathscope
