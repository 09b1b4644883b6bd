#include "pathscope/session/client_machine.hpp"

#include <fmt/format.h>

#include "pathscope/cluster/credit_policy.hpp"
#include "pathscope/core/log.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_max_servers = 4096;

/// A LEASE that has not arrived after this time will not.
constexpr TimeNs k_longest_way = 2 * k_second_ns;

/// When a server may believe that its client is gone: late, since nothing is lost by waiting.
TimeNs dead_after_of(DetectorKind kind) {
    return kind == DetectorKind::fixed ? 20 * k_second_ns : 5 * k_second_ns;
}

/// Not for good: the routing id of a connection is what no seal covers, so a bit of it may have flipped on its way. By
/// another connection the server is welcome.
message::Reject reject_instance() {
    return {RejectCode::malformed, "HELLO names another instance than its connection has.", 1000};
}

}  // namespace

void ClientMachine::on_hello(const std::string& instance, const message::Hello& hello, const Sender& sender) {
    const std::string who = conduct_name(sender.key, hello.name, sender.address);
    if (const auto ban = conduct_.ban_of(who, now_)) return reject_banned(instance, *ban);
    const std::optional<BitsMisfit> misfit = depends_on_build(config_.strategy)
                                                 ? bits_misfit(own_bits(), {hello.build, hello.golden})
                                                 : std::nullopt;
    auto found = servers_.find(instance);
    std::optional<bool> same_before;
    if (found != servers_.end()) same_before = found->second.same_bits;
    auto reject =
        hello.instance == instance ? reject_bits(misfit, config_.relaxed, same_before) : reject_instance();
    if (reject) {
        log_warning(fmt::format("Refused the server {}: {}", hello.name, reject->text));
        const bool malformed = reject->code == RejectCode::malformed;
        send(Channel::monitor, instance, std::move(*reject));
        return malformed ? offend(who, Offence::malformed) : void();
    }
    if (found != servers_.end()) {
        // It did not hear the WELCOME, or forgot its work: it starts over under the same id.
        Server& server = found->second;
        revoke(server.peer.id());
        server.credits.clear();
        server.progress = ProgressWatch(heartbeat_);
        step_peer(server, PeerCause::state_lost, "It said HELLO again.");
    } else {
        if (servers_.size() >= k_max_servers) {
            send(Channel::monitor, instance,
                 message::Reject{RejectCode::full, "The client has as many servers as it can take.", 5000});
            return;
        }
        const ServerId id{++last_server_};
        found =
            servers_
                .emplace(instance, Server{instance, hello.name, who, hello.pid, Peer(id, now_),
                                          FailureDetector(config_.detector, now_), ProgressWatch(heartbeat_)})
                .first;
        found->second.next_ping = next_look_ = now_;
        found->second.allowance = TokenBucket(config_.conduct.messages, now_);
        server_by_id_.emplace(id, &found->second);
        if (audit_.enabled()) authors_.emplace(id, Author{hello.name, who, !misfit});
        store_.name_server(id, hello.name);
        store_.count(Counter::servers_joined, 1, id);
        for (LocalServer& local : local_servers_)
            if (local.is(hello.pid, hello.name)) local.joined = true;
        step_peer(found->second, PeerCause::welcomed, fmt::format("{} said HELLO.", hello.name));
        if (misfit)
            log_warning(
                fmt::format("Admitted the server {} because of --relaxed; what it renders marks the "
                            "image as not reproducible. {}",
                            hello.name, misfit->what));
    }
    found->second.same_bits = !misfit;
    found->second.frames_heard = now_;
    send(Channel::monitor, instance, welcome(found->second.peer.id()), found->second.peer.id());
    servers_changed();
}

message::Welcome ClientMachine::welcome(ServerId id) const {
    message::Welcome welcome;
    welcome.session = session_;
    welcome.server = id;
    welcome.heartbeat_ms = std::uint32_t(heartbeat_ / k_millisecond_ns);
    welcome.dead_after_ms = std::uint32_t(dead_after_of(config_.detector) / k_millisecond_ns);
    welcome.credits = k_most_credits;
    welcome.epoch = work_.epoch();
    welcome.sequence = sequence_;
    welcome.state_hash = state_hash_;
    welcome.state = packed_state_;
    return welcome;
}

void ClientMachine::on(Server& server, message::SnapshotRequest&) {
    send(Channel::monitor, server.instance,
         message::Snapshot{session_, work_.epoch(), sequence_, state_hash_, packed_state_}, server.peer.id());
}

void ClientMachine::on(Server& server, message::ManifestRequest& message) {
    if (auto answer = job_.depot.answer(message))
        send(Channel::monitor, server.instance, std::move(*answer), server.peer.id());
}

void ClientMachine::on(Server& server, message::PieceRequest& message) {
    if (auto answer = job_.depot.answer(message))
        send(Channel::monitor, server.instance, std::move(*answer), server.peer.id());
    else
        count_dropped(server.peer.id(), "PIECE_REQUEST: the scene has no such file.", Channel::monitor);
}

void ClientMachine::on(Server& server, message::Ready& message) {
    if (message.session != session_ || message.epoch != work_.epoch() || message.state_hash != state_hash_)
        return;
    server.ready_for = message.epoch;
    const bool joins = server.peer.state() == PeerState::syncing;
    if (joins) step_peer(server, PeerCause::synced, "It holds state and scene.");
    // An idle server repeats READY with its heartbeat: time to deal anew by what speeds turned out to be.
    if (joins || config_.schedule == ScheduleKind::weighted_shares) servers_changed();
}

/// Only a server that owes no answer sends it. So whatever the client believes it to owe was lost, as with a connection
/// that broke; unless it was sent so recently that it may still be on its way.
void ClientMachine::on(Server& server, message::Credit& message) {
    // It was welcomed by the client that ran before this one, and does not hear what this one says.
    if (message.session != session_) return void(ask_who(server.instance));
    server.frames_heard = now_;
    server.credits.set_limit(std::min<std::size_t>(message.credits, k_most_credits));
    for (const LeaseId lease : server.credits.settle_lost(message.received, now_ - k_longest_way))
        release(lease, server.peer.id());
}

void ClientMachine::on(Server& server, message::Bye& message) {
    if (message.reason == ByeReason::draining) {
        step_peer(server, PeerCause::drain, message.text);
        return servers_changed();
    }
    lose(server.instance, message.reason == ByeReason::leaving ? PeerCause::left : PeerCause::lost,
         message.text);
}

void ClientMachine::step_peer(Server& server, PeerCause cause, std::string_view detail) {
    const PeerState before = server.peer.state();
    if (!server.peer.apply(cause, now_)) return;
    if (store_.keeps_events())
        record(StateEvent{"peer", server.peer.id(), name_of(before), name_of(server.peer.state()), detail});
}

/// A server is gone; what it owed is open again. Its entry, and so `instance` if it is the entry's, ends here.
void ClientMachine::lose(const std::string& instance, PeerCause cause, std::string_view why) {
    const auto found = servers_.find(instance);
    if (found == servers_.end()) return;
    Server& server = found->second;
    const ServerId id = server.peer.id();
    step_peer(server, cause, why);
    const std::size_t held = indirect_.outstanding(id);
    revoke(id);
    if (cause == PeerCause::lost) store_.count(Counter::died, 1, id);
    log_note(fmt::format("{} {}: {} {} lease{} of it go{} to others.", server.name,
                         cause == PeerCause::lost ? "is lost" : "left", why, held, held == 1 ? "" : "s",
                         held == 1 ? "es" : ""));
    std::erase(asking_, &server);
    server_by_id_.erase(id);
    if (const ServerId ids[]{id}; gave_indirect_.units_of(ids).empty() && !audit_.disputes(id))
        authors_.erase(id);
    servers_.erase(found);
    servers_changed();
}

}  // namespace pathscope
