#pragma once
/// The hours between a session's beginning and its picture: progress, checkpoints, Ctrl+C.

#include <atomic>
#include <optional>

#include "options.hpp"
#include "pathscope/metrics/endpoint.hpp"
#include "pathscope/session/client_session.hpp"

namespace pathscope {

/// What a run goes on from, if anything. A checkpoint may be days of work: one that is there is not written over unless it
/// was taken up. Everything that can be refused is refused here, before a scene is loaded.
[[nodiscard]] Result<std::optional<CheckpointFile>> open_checkpoint(const CheckpointOptions& options);

class RenderLoop {
  public:
    /// `earlier` is what the session was resumed with; `begin` is when this run's share of rendering began.
    RenderLoop(ClientSession& session, const EventStore& store, const CheckpointOptions& options,
               const WorkHistory& earlier, TimeNs begin);

    /// Figures go there, a few times a second. It outlives the loop.
    void publish_to(MetricsEndpoint& metrics) { metrics_ = &metrics; }

    /// Until the frame is complete; an error if it was interrupted before.
    [[nodiscard]] Result<void> run(const std::atomic<bool>& interrupted);

  private:
    [[nodiscard]] TimeNs longest_step() const;
    void fill(Checkpoint& into) const;
    void write_if_due();
    void publish_if_due();
    [[nodiscard]] Result<void> write_last();
    [[nodiscard]] Result<void> give_up();

    ClientSession& session_;
    const EventStore& store_;
    const WorkHistory& earlier_;
    TimeNs begin_;
    std::optional<CheckpointWriter> writer_;
    MetricsEndpoint* metrics_ = nullptr;
    TimeNs next_publication_ = 0;
};

}  // namespace pathscope
