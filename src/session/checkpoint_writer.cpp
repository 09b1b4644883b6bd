#include "pathscope/session/checkpoint_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <system_error>
#include <utility>

#include "pathscope/core/files.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/session/client_session.hpp"

namespace pathscope {
namespace {

/// A write of one second is followed by nine seconds without.
constexpr TimeNs k_least_pauses = 9;

}  // namespace

void capture(const ClientSession& session, const EventStore& store, const WorkHistory& earlier,
             double render_s, Checkpoint& into) {
    into.work = identity_of(session.state(), session.work().plan());
    const CounterTotals totals = store.totals();  // What was taken up is among them.
    const auto total = [&](Counter counter) { return totals[std::size_t(counter)]; };
    into.history = {earlier.runs + 1,
                    earlier.render_s + render_s,
                    session.work().indirect_ledger().rounds_committed(),
                    total(Counter::tiles),
                    total(Counter::rays),
                    total(Counter::samples),
                    total(Counter::nonfinite_dropped),
                    session.saturated(),
                    session.dropped(),
                    session.differing_rounds()};
    session.work().snapshot(into.frame);
}

CheckpointWriter::CheckpointWriter(std::filesystem::path path, TimeNs every, TimeNs now)
    : path_(std::move(path)), every_(every), next_(now + every) {
    remove_abandoned_parts(path_);
}

bool CheckpointWriter::due(TimeNs now) {
    if (writing_.valid()) {
        if (writing_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
        settle();
    }
    return now >= next_;
}

CheckpointWriter::Written CheckpointWriter::write() const {
    const TimeNs began = monotonic_now();
    Written written;
    try {
        written.outcome = write_file_atomically(path_, encode_checkpoint(checkpoint_));
    } catch (const std::exception& error) {  // Out of memory: nothing else here throws.
        written.outcome = failed(fmt::format("Cannot write {}: {}.", path_.string(), error.what()));
    }
    written.duration = monotonic_now() - began;
    return written;
}

void CheckpointWriter::begin_write(TimeNs now) {
    next_ = now + every_;
    try {
        writing_ = std::async(std::launch::async, [this] { return write(); });
    } catch (const std::system_error& error) {  // No thread is to be had.
        std::promise<Written> none;
        none.set_value({failed(fmt::format("Cannot write {}: {}.", path_.string(), error.what()))});
        writing_ = none.get_future();
    }
}

/// Waits for the write under way, if there is one, and says what changed.
void CheckpointWriter::settle() {
    if (!writing_.valid()) return;
    const Written written = writing_.get();
    next_ = std::max(next_, monotonic_now() + k_least_pauses * written.duration);
    if (!written.outcome && !failing_)
        log_warning(fmt::format("{} Rendering goes on; the last checkpoint that could be written stays.",
                                written.outcome.error().message));
    if (written.outcome && failing_)
        log_note(fmt::format("Checkpoints can be written to {} again.", path_.string()));
    failing_ = !written.outcome;
}

}  // namespace pathscope
