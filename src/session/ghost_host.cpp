#include "pathscope/session/ghost_host.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "ghost.hpp"
#include "pathscope/net/descriptor_limit.hpp"

namespace pathscope {
namespace {

constexpr TimeNs k_longest_wait = k_second_ns;

/// Key of the pipe that wakes us, beside those of ghosts.
constexpr std::uint64_t k_wake_key = ~std::uint64_t{0};

/// A ghost has two sockets, of one mailbox and one connection each; those of an old link close in the background while
/// the new ones open.
std::size_t descriptors_for(int ghosts) { return 64 + 6 * std::size_t(ghosts); }
int sockets_for(int ghosts) { return 16 + 4 * ghosts; }

}  // namespace

Result<std::unique_ptr<GhostHost>> GhostHost::create(GhostConfig config) {
    CHECK(config.count >= 1 && config.count <= k_most_ghosts, config.count);
    const std::size_t wanted = descriptors_for(config.count);
    if (const std::size_t allowed = raise_descriptor_limit(wanted); allowed < wanted)
        return failed(
            fmt::format("{} ghosts need {} open files, but this process may have {}; raise the limit "
                        "(ulimit -n), or ask for fewer ghosts.",
                        config.count, wanted, allowed));
    Result<WakePair> wake = WakePair::create();
    if (!wake) return wake.error();
    Result<CrowdPoller> poller = CrowdPoller::create();
    if (!poller) return poller.error();
    return std::unique_ptr<GhostHost>(new GhostHost(std::move(config), std::move(*wake), std::move(*poller)));
}

GhostHost::GhostHost(GhostConfig config, WakePair wake, CrowdPoller poller)
    : config_(std::move(config)),
      context_({.io_threads = 1, .max_sockets = sockets_for(config_.count)}),
      wake_(std::move(wake)),
      poller_(std::move(poller)) {
    poller_.add(wake_.pollable(), k_wake_key);
    const std::vector<double> speeds = ghost_speeds(config_.speed, config_.count, config_.seed);
    for (std::size_t i = 0; i < speeds.size(); ++i)
        ghosts_.push_back(std::make_unique<Ghost>(context_, poller_, config_, int(i) + 1, speeds[i], 2 * i));
}

GhostHost::~GhostHost() = default;

void GhostHost::request_stop() noexcept {
    stop_requested_.store(true);
    wake_.notify();
}

Result<void> GhostHost::run() {
    for (const auto& ghost : ghosts_)
        if (const auto dialled = ghost->dial(); !dialled) return dialled;
    for (std::size_t i = 0; i < ghosts_.size(); ++i) tend(i);
    while (!stop_requested_.load() && !failure_ && ended_ < ghosts_.size()) step();
    if (failure_) return *failure_;
    for (const auto& ghost : ghosts_)
        if (ghost->machine().refusal()) return *ghost->machine().refusal();
    say_goodbye();
    return {};
}

void GhostHost::step() {
    const TimeNs now = monotonic_now();
    const TimeNs next = timers_.empty() ? now + k_longest_wait : timers_.top().at;
    for (const std::uint64_t key : poller_.wait(std::clamp<TimeNs>(next - now, 0, k_longest_wait))) {
        if (key == k_wake_key) {
            wake_.clear();
            continue;
        }
        const std::size_t index = key / 2;
        ghosts_[index]->stir(key % 2 == 0 ? Channel::monitor : Channel::frames);
        tend(index);
    }
    for (const TimeNs due = monotonic_now(); !timers_.empty() && timers_.top().at <= due;) {
        const Timer timer = timers_.top();
        timers_.pop();
        if (ghosts_[timer.ghost]->planned == timer.at) tend(timer.ghost);
    }
}

void GhostHost::tend(std::size_t index) {
    Ghost& ghost = *ghosts_[index];
    if (ghost.machine().ended()) return;
    ghost.tend();
    if (ghost.machine().ended()) {
        ghost.unlink();
        ++ended_;
        return;
    }
    const TimeNs now = monotonic_now();
    TimeNs next = ghost.next_timer(now);
    if (!ghost.machine().linked()) {
        if (const auto dialled = ghost.dial(); !dialled) failure_ = dialled.error();
        next = now;
    }
    if (ghost.planned > now && ghost.planned <= next) return;
    ghost.planned = next;
    timers_.push({next, index});
}

void GhostHost::say_goodbye() {
    for (const auto& ghost : ghosts_)
        if (ghost->machine().linked() && !ghost->machine().ended()) ghost->leave();
}

}  // namespace pathscope
