#include "pathscope/session/client_machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pathscope/core/log.hpp"

namespace pathscope {
namespace {

/// The end of a connection is told a moment before the socket itself knows: most often some microseconds, and on a busy
/// machine many milliseconds. So each pause between two probes is twice the one before.
constexpr int k_probes = 10;
constexpr TimeNs k_first_probe_pause = k_millisecond_ns / 10;
constexpr TimeNs k_confirming_pause = k_first_probe_pause;

/// A probe is a PING to every server, some microseconds each. Who only makes and breaks connections, as fast as it can,
/// shall not keep the client from its work.
constexpr TimeNs k_probe_pause_per_server = 20'000;

/// Looking at a thousand servers takes a fraction of a millisecond: not after every message.
constexpr TimeNs k_shortest_pause = 10 * k_millisecond_ns;
constexpr TimeNs k_longest_pause = 50 * k_millisecond_ns;

/// A server that owes nothing says CREDIT with each heartbeat.
constexpr TimeNs k_frames_patience = 5 * k_second_ns;

}  // namespace

void ClientMachine::on(Server& server, message::Ping& message) {
    send(Channel::monitor, server.instance,
         message::Pong{message.token, now_, now_, indirect_.rounds_committed(), 0}, server.peer.id());
}

void ClientMachine::on(Server& server, message::Pong& message) {
    server.detector.on_heartbeat(now_);
    const auto rtt = server.clock.add({TimeNs(message.token), message.received_ns, message.sent_ns, now_});
    if (rtt) {
        server.round_trip = server.clock.at(now_)->rtt;
        store_.add_latency(Latency::heartbeat, *rtt, server.peer.id());
    }
    if (message.progress > server.told_progress) ++work_seen_;  // What a peer says may be any number.
    server.told_progress = message.progress;
    if (std::exchange(server.at_once, message.at_once) != message.at_once) servers_changed();
    server.progress.on_heartbeat(message.progress, message.queue, now_);
    watch_progress(server);
}

/// A stuck server keeps nothing, and is given nothing until its work goes on. It is not told: what it finishes late still
/// counts if nobody was quicker.
void ClientMachine::watch_progress(Server& server) {
    const PeerState state = server.peer.state();
    const bool stuck = server.progress.stuck(server.turnaround.mean());
    if (stuck && (state == PeerState::ready || state == PeerState::suspect)) {
        const ServerId id = server.peer.id();
        const std::string why = fmt::format("It answers, but its work has stood still for {:.1f} s.",
                                            to_seconds(server.progress.still()));
        step_peer(server, PeerCause::stuck, why);
        const std::size_t ended = revoke(id);
        store_.count(Counter::stuck, 1, id);
        log_note(fmt::format("{} is stuck: {} {} lease{} of it go{} to others.", server.name, why, ended,
                             ended == 1 ? "" : "s", ended == 1 ? "es" : ""));
        servers_changed();
    } else if (!stuck && state == PeerState::stuck) {
        step_peer(server, PeerCause::moved, "Its work goes on.");
        server.moved = now_;
        server.turnaround = {};
        log_note(fmt::format("{} is no longer stuck.", server.name));
        servers_changed();
    }
}

bool ClientMachine::ping(Server& server) {
    return send(Channel::monitor, server.instance,
                message::Ping{std::uint64_t(now_), sequence_, indirect_.rounds_committed(), 0},
                server.peer.id());
}

void ClientMachine::on_connection_lost(TimeNs now) {
    now_ = now;
    if (config_.detector == DetectorKind::fixed) return;
    probes_left_ = k_probes;
    next_probe_ = std::max(now_, soonest_probe_);
}

/// Who cannot be reached twice has no connection any more. Why twice: a server that leaves says so and hangs up, and what it
/// said is read between the two.
void ClientMachine::probe_connections() {
    soonest_probe_ = now_ + k_probe_pause_per_server * TimeNs(servers_.size());
    next_probe_ = std::max(soonest_probe_, now_ + (k_first_probe_pause << (k_probes - probes_left_)));
    --probes_left_;
    std::vector<std::string> unreachable;
    for (auto& [instance, server] : servers_) {
        const bool was_unreachable = std::exchange(server.unreachable, !ping(server));
        if (!server.unreachable) continue;
        if (was_unreachable) {
            unreachable.push_back(instance);
        } else {
            probes_left_ = std::max(probes_left_, 1);
            next_probe_ = std::max(soonest_probe_, now_ + k_confirming_pause);
        }
    }
    for (const std::string& instance : unreachable)
        lose(instance, PeerCause::lost, "Its connection is gone.");
}

/// A server that lives, but not on frames: there its routing id came damaged, or is taken, and it cannot know. As somebody
/// new it will have both connections under one name again.
void ClientMachine::watch_frames(const Server& server) {
    const bool may_be_silent = server.peer.state() != PeerState::syncing && !server.peer.accepts_work();
    if (may_be_silent || server.credits.limit() > 0 || server.credits.owed() > 0 ||
        now_ - server.frames_heard < std::max(k_frames_patience, 3 * heartbeat_))
        return;
    if (ask_who(server.instance))
        log_note(fmt::format("{} is not heard on the channel of frames; it is to dial again.", server.name));
}

void ClientMachine::watch_heartbeats() {
    std::vector<std::pair<std::string, std::string>> dead;
    next_look_ = now_ + k_longest_pause;
    serve_all_ = true;  // Debts are written off, and rounds become stragglers.
    for (auto& [instance, server] : servers_) {
        if (now_ >= server.next_ping) {
            ping(server);
            server.next_ping = now_ + heartbeat_;
        }
        next_look_ = std::min(next_look_, server.next_ping);
        const Suspicion suspicion = server.detector.assess(now_);
        if (suspicion.state == Liveness::dead)
            dead.emplace_back(instance,
                              fmt::format("It has been silent for {:.2f} s.", to_seconds(suspicion.silence)));
        else if (suspicion.state == Liveness::suspect && server.peer.state() == PeerState::ready)
            step_peer(server, PeerCause::silent,
                      fmt::format("It has been silent for {:.2f} s.", to_seconds(suspicion.silence)));
        server.credits.write_off(now_);
        watch_frames(server);
    }
    next_look_ = std::max(next_look_, now_ + k_shortest_pause);
    for (const auto& [instance, why] : dead) lose(instance, PeerCause::lost, why);
}

}  // namespace pathscope
