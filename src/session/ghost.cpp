#include "ghost.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <tuple>

#include "channel_options.hpp"
#include "pathscope/math/random.hpp"
#include "pathscope/session/build_identity.hpp"

namespace pathscope {
namespace {

/// Light that looks like light to everything that handles it: 32 bits in each channel of each pixel, as sums of a few
/// samples at the default quantum have; half of each number is then zeros, and a tile packs to half its size.
const std::vector<PixelSum>& noise() {
    static const std::vector<PixelSum> sums = [] {
        std::vector<PixelSum> made(std::size_t{1} << 14);
        HashRng rng(1);
        for (PixelSum& sum : made) sum = {rng.next_u32(), rng.next_u32(), rng.next_u32()};
        return made;
    }();
    return sums;
}

std::vector<PixelSum> noise_from(std::size_t at, std::size_t pixels) {
    const std::vector<PixelSum>& all = noise();
    std::vector<PixelSum> sums;
    std::size_t left = pixels;
    sums.reserve(left);
    for (; left > 0; at = 0) {
        const std::size_t piece = std::min(left, all.size() - at);
        sums.insert(sums.end(), all.begin() + std::ptrdiff_t(at), all.begin() + std::ptrdiff_t(at + piece));
        left -= piece;
    }
    return sums;
}

/// Noise of that many pixels, packed. To pack and hash it costs more than everything else that a ghost does, and a client
/// cannot tell whether it was done for this tile or for one before: so it is done for a few, which then serve again.
class PackedNoise {
  public:
    const message::Tile& of(std::size_t pixels, WireFormat format, std::uint32_t seed) {
        const std::uint32_t variant = seed % k_variants;
        if (packed_.size() >= k_most) packed_.clear();  // A client may ask for blocks of a million sizes.
        const auto [found, is_new] = packed_.try_emplace({pixels, format, variant});
        if (is_new) put_block_result(found->second, noise_from(variant * k_stride, pixels), format);
        return found->second;
    }

  private:
    static constexpr std::uint32_t k_variants = 8;
    static constexpr std::size_t k_stride = 1021;
    static constexpr std::size_t k_most = 64;
    std::map<std::tuple<std::size_t, WireFormat, std::uint32_t>, message::Tile> packed_;
};

std::shared_ptr<const Scene> no_scene() {
    static const auto scene = std::make_shared<const Scene>();
    return scene;
}

}  // namespace

// ---- The renderer.

void ModelledRenderer::begin(const RoundJob& job, TimeNs now) {
    const TimeNs started = std::max(now, free_at_);
    const TimeNs duration = from_seconds(double(job.round.samples()) / samples_per_second_);
    free_at_ = started + std::max<TimeNs>(1, duration);
    queue_.push_back({job.ticket, job.part, job.round, started, free_at_});
}

void ModelledRenderer::cancel(std::uint64_t ticket) {
    for (Queued& queued : queue_) queued.cancelled |= queued.ticket == ticket;
}

void ModelledRenderer::cancel_all() {
    for (Queued& queued : queue_) queued.cancelled = true;
}

std::uint64_t ModelledRenderer::work_done(TimeNs now) const {
    if (queue_.empty()) return finished_;
    // Only the first is in work, or several are done and not yet taken.
    double samples = 0;
    for (const Queued& queued : queue_)
        samples += to_seconds(std::clamp(now, queued.started, queued.done) - queued.started);
    return finished_ + std::uint64_t(samples * samples_per_second_);
}

std::optional<TimeNs> ModelledRenderer::next() const {
    const bool any_cancelled =
        std::any_of(queue_.begin(), queue_.end(), [](const Queued& queued) { return queued.cancelled; });
    if (any_cancelled) return 0;
    return queue_.empty() ? std::nullopt : std::optional(queue_.front().done);
}

RoundOutcome ModelledRenderer::take(TimeNs now) {
    const auto cancelled =
        std::find_if(queue_.begin(), queue_.end(), [](const Queued& queued) { return queued.cancelled; });
    if (cancelled != queue_.end()) {
        // The time that it would still have taken is there for those behind it.
        const TimeNs saved = cancelled->done - std::clamp(now, cancelled->started, cancelled->done);
        for (auto behind = std::next(cancelled); behind != queue_.end(); ++behind) {
            behind->started -= saved;
            behind->done -= saved;
        }
        free_at_ -= saved;
        cancelled->done -= saved;
        const RoundOutcome outcome = outcome_of(*cancelled);
        finished_ += outcome.round.samples();  // The counter must not fall.
        queue_.erase(cancelled);
        return outcome;
    }
    CHECK(!queue_.empty() && queue_.front().done <= now, queue_.size());
    RoundOutcome outcome = outcome_of(queue_.front());
    queue_.pop_front();
    finished_ += outcome.round.samples();
    RoundResult result;  // Its light is made when it is packed.
    result.samples = result.rays = outcome.round.samples();
    outcome.result = std::move(result);
    return outcome;
}

RoundOutcome ModelledRenderer::outcome_of(const Queued& queued) {
    RoundOutcome outcome;
    outcome.ticket = queued.ticket;
    outcome.part = queued.part;
    outcome.round = queued.round;
    outcome.started = queued.started;
    outcome.duration = queued.done - queued.started;
    return outcome;
}

// ---- The ghost.

GhostHost::Ghost::Ghost(const Context& context, CrowdPoller& poller, const GhostConfig& config, int number,
                        double samples_per_second, std::uint64_t key)
    : context_(context),
      poller_(poller),
      endpoints_{fmt::format("tcp://{}:{}", config.host, config.ports[1]),
                 fmt::format("tcp://{}:{}", config.host, config.ports[2])},
      key_(key),
      machine_({fmt::format("{}-{}", config.name, number), program_version(), own_bits(), 1,
                std::uint32_t(::getpid()), config.host},
               SceneCache({}), *this),
      renderer_(samples_per_second) {}

GhostHost::Ghost::~Ghost() { unlink(); }

void GhostHost::Ghost::unlink() {
    if (!link_) return;
    poller_.remove(link_->monitor.pollable());
    poller_.remove(link_->frames.pollable());
    link_.reset();
}

Result<void> GhostHost::Ghost::dial() {
    unlink();
    const std::string instance = random_routing_id();
    auto monitor =
        DealerSocket::connect(context_, endpoints_[0], instance, channel_options(Channel::monitor));
    if (!monitor) return monitor.error();
    auto frames = DealerSocket::connect(context_, endpoints_[1], instance, channel_options(Channel::frames));
    if (!frames) return frames.error();
    link_.emplace(Link{std::move(*monitor), std::move(*frames)});
    poller_.add(link_->monitor.pollable(), key_);
    poller_.add(link_->frames.pollable(), key_ + 1);
    stirred_ = {true, true};
    machine_.on_linked(instance, monotonic_now());
    return {};
}

void GhostHost::Ghost::tend() {
    do work();
    while (machine_.linked() && !machine_.ended() && (receive_next() || to_load_));
}

/// Outcomes, and what is due.
void GhostHost::Ghost::work() {
    const TimeNs now = monotonic_now();
    if (auto state = std::exchange(to_load_, std::nullopt)) {
        LoadedScene loaded{std::move(*state), no_scene()};
        machine_.on_loaded(loaded, now);
    }
    while (renderer_.next().value_or(now + 1) <= now) {
        RoundOutcome outcome = renderer_.take(now);
        machine_.on_outcome(outcome, now);
    }
    machine_.on_timers(now);
}

TimeNs GhostHost::Ghost::next_timer(TimeNs now) const {
    return std::min(machine_.next_timer(now), renderer_.next().value_or(now + k_second_ns));
}

/// One message of a socket that stirred, if there is any. One, and not all: to find out that a socket has nothing more is a
/// system call, and it has to be found out again after the answer was sent.
bool GhostHost::Ghost::receive_next() {
    for (const Channel channel : {Channel::monitor, Channel::frames}) {
        bool& stirred = stirred_[channel == Channel::frames];
        if (!stirred) continue;
        if (auto frames = socket_of(channel).receive()) {
            machine_.on_message(std::move(*frames), channel, monotonic_now());
            return true;
        }
        stirred = false;
    }
    return false;
}

void GhostHost::Ghost::leave() {
    machine_.drain(monotonic_now());
    renderer_.cancel_all();
    work();
    if (machine_.linked()) machine_.say_goodbye(monotonic_now());
}

void GhostHost::Ghost::fill_tile(message::Tile& tile, const RoundResult& result, WireFormat format) const {
    static thread_local PackedNoise noise;
    const message::Tile& packed = noise.of(std::size_t(result.samples / tile.count), format,
                                           hash_combine(hash_u32(tile.unit), tile.first));
    tile.codec = packed.codec;
    tile.raw_bytes = packed.raw_bytes;
    tile.hash = packed.hash;
    tile.result = packed.result;
}

bool GhostHost::Ghost::send(Channel channel, Frames&& frames) {
    const bool left = socket_of(channel).send(std::move(frames)) == SendOutcome::delivered;
    stir(channel);  // Even if it did not leave: the attempt may have taken in news of what arrived.
    return left;
}

}  // namespace pathscope
