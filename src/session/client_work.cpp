#include "pathscope/session/client_machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pathscope/core/log.hpp"

namespace pathscope {

void ClientMachine::on_outcome(RoundOutcome& outcome, TimeNs now) {
    now_ = now;
    const LocalWork work = local_work_.extract(outcome.ticket).mapped();
    if (work.audit) return on_own_opinion(work, outcome);
    if (work.direct) settle(LightPart::direct, *work.direct, work.indirect ? outcome.direct : outcome.result);
    if (work.indirect) settle(LightPart::indirect, *work.indirect, outcome.result);
}

/// Books what the client's own renderer made of a lease.
void ClientMachine::settle(LightPart part, const Lease& lease, const std::optional<RoundResult>& result) {
    if (!result) {  // Cancelled: its epoch ended, or the time limit was reached.
        if (part == LightPart::direct)
            work_.release_direct(lease, now_);
        else
            release(lease.id, k_local_server);
        return;
    }
    const ResultClaim claim{lease.id, lease.epoch, lease.unit, lease.first, lease.count, k_local_server};
    const Commit commit = work_.commit(part, claim, result->sums, now_);
    if (commit.verdict == Verdict::accepted) {
        count_result(*result, k_local_server);
        note_merged(part, claim, commit.rounds, *result, result->sums);
    }
    cancel_superseded(commit.superseded);
}

void ClientMachine::on(Server& server, message::Tile& tile) {
    server.frames_heard = now_;
    const ServerId id = server.peer.id();
    server.credits.settle(tile.lease);
    const ResultClaim claim{
        tile.lease, tile.session == session_ ? tile.epoch : Epoch{}, tile.unit, tile.first, tile.count, id};
    // Decoded only if it counts, committed only if it decodes.
    const bool audits = audit_.holds(claim);
    if (const Verdict verdict = indirect_.judge(claim); !audits && verdict != Verdict::accepted) {
        indirect_.commit_indirect(claim, {}, {}, 0, now_);
        // Results may come late: of rounds that are committed, forgotten or undone, or of an epoch before.
        const bool never_granted = verdict == Verdict::unknown || verdict == Verdict::mismatched;
        return never_granted ? offend(server.who, Offence::unknown_lease) : void();
    }
    const PixelRect rect = audits ? work_.rect_of(tile.unit) : indirect_.rect_of(claim);
    RoundResult result;
    result.rays = tile.rays;
    result.samples = std::uint64_t(rect.area()) * tile.count;
    result.dropped = std::move(tile.dropped);
    result.dropped_count = tile.dropped_count;
    result.saturated_count = tile.saturated_count;
    arrived_.resize(std::size_t(rect.area()));
    if (const auto read = read_strategy_result(strategy_, tile, rect, arrived_, job_.state.settings.wire);
        !read) {
        release(tile.lease, id);
        count_dropped(id, read.error().message, Channel::frames);
        return offend(server.who, Offence::corrupt);
    }

    if (audits) return on_opinion(claim, arrived_);

    const Commit commit = indirect_.commit_indirect(claim, result, arrived_, tile.render_ns, now_);
    store_.count_all(
        {{Counter::tile_bytes, tile.result.size()}, {Counter::tile_bytes_unpacked, tile.raw_bytes}}, id);
    server.speed.add(double(result.samples), tile.render_ns);
    if (now_ - commit.since_grant >= server.moved) server.turnaround.add(commit.since_grant);
    store_.add_latency(Latency::tile, commit.since_grant, id);
    count_result(result, id);
    if (!server.same_bits) {
        differing_rounds_ += commit.rounds;
        store_.count(Counter::differing_rounds, commit.rounds, id);
    }
    note_merged(LightPart::indirect, claim, commit.rounds, result, arrived_);
    const bool may_be_drawn =
        store_.keeps_events() && is_plausible(tile.started_ns) && is_plausible(tile.render_ns);
    if (const auto offset = server.clock.at(now_); offset && may_be_drawn)
        store_.record(
            {offset->to_client(tile.started_ns), 0, id, 0, SpanEvent{"render", tile.render_ns, tile.lease}});
    cancel_superseded(commit.superseded);
}

void ClientMachine::on(Server& server, message::Nack& message) {
    server.frames_heard = now_;
    server.credits.settle(message.lease);
    if (message.session != session_ || message.epoch != work_.epoch()) return;
    release(message.lease, server.peer.id());
    if (message.code == NackCode::state || message.code == NackCode::scene) {
        step_peer(server, PeerCause::state_lost, name_of(message.code));
        return servers_changed();
    }
    if (message.code == NackCode::unsupported || message.code == NackCode::failed ||
        message.code == NackCode::memory) {
        // It is welcome again when it forgot what ails it, but not for ever.
        const std::string instance = server.instance, who = server.who;
        const auto ban = conduct_.report(who, Offence::failed, now_);
        if (ban) shut_out(who, *ban);
        lose(instance, PeerCause::lost, fmt::format("It cannot do its work ({}).", message.text));
    }
}

void ClientMachine::count_result(const RoundResult& result, ServerId server) {
    store_.count_all({{Counter::tiles, 1},
                      {Counter::rays, result.rays},
                      {Counter::samples, result.samples},
                      {Counter::nonfinite_dropped, result.dropped_count}},
                     server);
    saturated_ += result.saturated_count;
    for (const DroppedSample& dropped : result.dropped)
        if (dropped_.size() < k_max_dropped_listed) dropped_.push_back(dropped);
}

void ClientMachine::cancel_superseded(const std::vector<Lease>& leases) {
    for (const Lease& lease : leases) cancel(lease);
}

void ClientMachine::cancel(const Lease& lease) {
    if (const auto holder = server_by_id_.find(lease.server); holder != server_by_id_.end())
        send(Channel::frames, holder->second->instance,
             message::Cancel{session_, lease.epoch, {lease.id.value}}, lease.server);
}

/// A lease ends without a result, whatever it was for.
void ClientMachine::release(LeaseId lease, ServerId server) {
    if (!audit_.release(lease, server)) indirect_.release(lease, server, now_);
}

std::size_t ClientMachine::revoke(ServerId server) {
    audit_.revoke(server);
    return indirect_.revoke(server, now_);
}

Progress ClientMachine::progress() const {
    Progress progress;
    progress.direct = work_.direct_progress();
    progress.indirect = work_.indirect_progress();
    progress.servers_known = alive_servers();
    for (const auto& [instance, server] : servers_) progress.servers_ready += server.peer.accepts_work();
    progress.alone = announced_alone_;
    progress.waiting = config_.min_servers > 0 && !reached_min_servers_;
    return progress;
}

}  // namespace pathscope
