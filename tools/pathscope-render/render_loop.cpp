#include "render_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "pathscope/core/files.hpp"
#include "pathscope/core/log.hpp"
#include "progress_line.hpp"

namespace pathscope {
namespace {

constexpr TimeNs k_longest_step = 200 * k_millisecond_ns;
constexpr TimeNs k_publication_pause = 250 * k_millisecond_ns;
constexpr TimeNs k_shortest_step =
    10 * k_millisecond_ns;  ///< While a checkpoint that is due waits for a disk.

/// Something whose presence cannot be told is there, so that opening it says why.
bool is_there(const std::filesystem::path& path) {
    std::error_code unknown;
    return std::filesystem::exists(path, unknown) || unknown;
}

}  // namespace

Result<std::optional<CheckpointFile>> open_checkpoint(const CheckpointOptions& options) {
    std::optional<CheckpointFile> file;
    if (options.resume && (!options.resume_if_there || is_there(*options.resume))) {
        Result<CheckpointFile> read = CheckpointFile::read(*options.resume);
        if (!read) return read.error();
        file = std::move(*read);
    }
    if (!options.write) return file;
    std::error_code ignored;
    const bool goes_on = file && std::filesystem::equivalent(*options.resume, *options.write, ignored);
    if (!goes_on && is_there(*options.write))
        return bad_input(fmt::format(
            "--checkpoint {0}: the file is there already. Add --resume {0} to go on from it, or remove it "
            "to begin anew.",
            options.write->string()));
    if (const auto ok = check_place(*options.write); !ok) return ok.error();
    return file;
}

RenderLoop::RenderLoop(ClientSession& session, const EventStore& store, const CheckpointOptions& options,
                       const WorkHistory& earlier, TimeNs begin)
    : session_(session), store_(store), earlier_(earlier), begin_(begin) {
    if (options.write) writer_.emplace(*options.write, options.every, monotonic_now());
}

Result<void> RenderLoop::run(const std::atomic<bool>& interrupted) {
    ProgressLine line;
    if (earlier_.runs > 0) {
        const Progress progress = session_.progress();
        log_note(fmt::format("Going on with {:.0f} % of direct and {:.0f} % of indirect light.",
                             100 * progress.direct, 100 * progress.indirect));
    }
    while (!session_.complete()) {
        session_.step(longest_step());
        line.show(session_.progress());
        write_if_due();
        publish_if_due();
        if (interrupted.load()) return give_up();
    }
    if (const auto written = write_last(); !written && !writer_->failing())
        log_warning(fmt::format("{} The picture is finished all the same.", written.error().message));
    return {};
}

TimeNs RenderLoop::longest_step() const {
    if (!writer_) return k_longest_step;
    return std::clamp<TimeNs>(writer_->next() - monotonic_now(), k_shortest_step, k_longest_step);
}

void RenderLoop::fill(Checkpoint& into) const {
    capture(session_, store_, earlier_, to_seconds(monotonic_now() - begin_), into);
}

void RenderLoop::write_if_due() {
    const TimeNs now = monotonic_now();
    if (writer_ && writer_->due(now)) writer_->begin(now, [this](Checkpoint& into) { fill(into); });
}

void RenderLoop::publish_if_due() {
    if (!metrics_) return;
    const TimeNs now = monotonic_now();
    if (now < next_publication_) return;
    metrics_->publish(session_.figures(), now);
    next_publication_ = now + k_publication_pause;
}

Result<void> RenderLoop::write_last() {
    return writer_ ? writer_->finish([this](Checkpoint& into) { fill(into); }) : Result<void>();
}

Result<void> RenderLoop::give_up() {
    if (!writer_) return failed("Interrupted; nothing was written.");
    if (const auto written = write_last(); !written)
        return failed(fmt::format("Interrupted. {} What an earlier checkpoint holds is not lost.",
                                  written.error().message));
    return failed(fmt::format("Interrupted; go on with --resume {}.", writer_->path().string()));
}

}  // namespace pathscope
