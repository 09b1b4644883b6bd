#pragma once
/// Writes checkpoints while the frame is rendered, without holding it up.
///
///     CheckpointWriter writer(path, every, now);
///     while (!session.complete()) {
///         session.step(...);
///         if (writer.due(now)) writer.begin(now, [&](Checkpoint& into) { capture(session, ..., into); });
///     }
///     writer.finish([&](Checkpoint& into) { capture(session, ..., into); });
///
/// The caller fills a checkpoint between two steps, when no round is half done: a copy of the sums, which is all that the
/// session waits for. A thread packs, hashes and writes it, and the next is not begun before. The memory of the copy is
/// used again each time, so that only the first one asks the kernel for pages.
///
/// What cannot be written (a full disk, a folder that is gone) is said once, and once more when it can; the frame goes on,
/// and the file that was written last stays as it is, whole.
/// How far apart: `every`, but never so close that writing takes more than a tenth of the thread's time.
/// Thread safety: one thread.   Test: tests/session/test_checkpoint_writer.cpp, tests/system/test_checkpoint.py

#include <filesystem>
#include <future>
#include <utility>

#include "pathscope/core/clock.hpp"
#include "pathscope/session/checkpoint.hpp"

namespace pathscope {

inline constexpr TimeNs k_default_checkpoint_interval = 5 * k_second_ns;

class ClientSession;

/// What the session has between two of its steps. `earlier` is what it went on from, `render_s` the time since.
void capture(const ClientSession& session, const EventStore& store, const WorkHistory& earlier,
             double render_s, Checkpoint& into);

class CheckpointWriter {
  public:
    /// Removes what a killed program left half written of this file. Requires: nobody else writes it.
    CheckpointWriter(std::filesystem::path path, TimeNs every, TimeNs now);
    CheckpointWriter(const CheckpointWriter&) = delete;
    CheckpointWriter& operator=(const CheckpointWriter&) = delete;

    /// It is time for the next, and the one before is written.
    [[nodiscard]] bool due(TimeNs now);
    /// The moment before which due() says no.
    [[nodiscard]] TimeNs next() const { return next_; }

    /// Calls fill(checkpoint), and writes it in the background. Requires: due().
    template <class Fill>
    void begin(TimeNs now, Fill&& fill) {
        std::forward<Fill>(fill)(checkpoint_);
        begin_write(now);
    }

    /// Writes a last one, whatever the time, and waits for it. The error says why there is none of this moment.
    template <class Fill>
    [[nodiscard]] Result<void> finish(Fill&& fill) {
        settle();
        std::forward<Fill>(fill)(checkpoint_);
        return write().outcome;
    }

    /// The last one in the background could not be written, and that has been said.
    [[nodiscard]] bool failing() const { return failing_; }
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  private:
    struct Written {
        Result<void> outcome;
        TimeNs duration = 0;
    };

    [[nodiscard]] Written write() const;
    void begin_write(TimeNs now);
    void settle();

    std::filesystem::path path_;
    TimeNs every_;
    TimeNs next_;
    bool failing_ = false;
    Checkpoint checkpoint_;         ///< Belongs to the thread that writes, while there is one.
    std::future<Written> writing_;  // Last, so that it ends first.
};

}  // namespace pathscope
