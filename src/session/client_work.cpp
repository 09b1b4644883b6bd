#include "pathscope/session/client_machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pathscope/cluster/credit_policy.hpp"
#include "pathscope/cluster/lease_size.hpp"
#include "pathscope/core/log.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_local_rounds = 2;  ///< One in work, one waiting: no pause between them.
constexpr TimeNs k_straggler_watch = 10 * k_millisecond_ns;
constexpr TimeNs k_join_patience =
    20 * k_second_ns;  ///< A local server that has not joined by then is not waited for.

}  // namespace

int ClientMachine::alive_servers() const {
    return int(std::count_if(servers_.begin(), servers_.end(),
                             [](const auto& entry) { return entry.second.stays(); }));
}

bool ClientMachine::renders_alone() const {
    return !relays_ && std::none_of(servers_.begin(), servers_.end(), [](const auto& entry) {
        return entry.second.stays();
    }) && !expects_servers();
}

bool ClientMachine::expects_servers() const {
    if (!reached_min_servers_ && config_.min_servers > 0) {
        const bool can_come = config_.listens || now_ - started_ < k_join_patience;
        if (can_come) return true;
    }
    return now_ - started_ < k_join_patience &&
           std::any_of(local_servers_.begin(), local_servers_.end(),
                       [](const LocalServer& local) { return !local.joined && !local.ended; });
}

/// Tells the schedule who may be given work. Once for all that changed since work was handed out: when a thousand join at
/// once, each of them asks for it.
void ClientMachine::tell_schedule() {
    tell_schedule_ = false;
    std::vector<ServerShare> shares;
    int ready = 0;
    places_ = 0;
    for (const auto& [instance, server] : servers_) {
        const PeerState state = server.peer.state();
        ready += state == PeerState::ready || state == PeerState::suspect;
        if (state == PeerState::ready || state == PeerState::suspect)
            shares.push_back({server.peer.id(), server.speed.per_second()});
        if (server.peer.accepts_work())
            places_ += std::min<std::uint64_t>(std::uint64_t{server.at_once} + 1, k_most_credits);
    }
    reached_min_servers_ = reached_min_servers_ || ready >= std::max(1, config_.min_servers);
    if (renders_alone()) shares.push_back({k_local_server, 0});
    std::sort(shares.begin(), shares.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
    indirect_.set_servers(std::move(shares));
}

void ClientMachine::hand_out() {
    if (stopped_) return;
    const bool alone = renders_alone();
    if (alone != announced_alone_) {
        announced_alone_ = alone;
        servers_changed();
        if (alone && last_server_ > 0 && !work_.complete())
            log_note("No server is left; the client carries on alone.");
    }
    if (tell_schedule_) tell_schedule();
    if (config_.min_servers == 0 || reached_min_servers_) hand_out_to_servers();
    hand_out_locally();
}

/// To those that answered; to all only where it may be of use, for there may be thousands.
void ClientMachine::hand_out_to_servers() {
    const bool more_rounds = std::exchange(rounds_open_, indirect_.rounds_open()) != indirect_.rounds_open();
    bool idle = false;
    if (std::exchange(serve_all_, false) || more_rounds || indirect_.any_reopened()) {
        for (auto& [instance, server] : servers_) idle |= hand_out_to(server);
    } else {
        for (Server* const server : asking_) idle |= hand_out_to(*server);
    }
    for (Server* const server : asking_) server->asks = false;
    asking_.clear();
    // Who found nothing to do may soon help a straggler.
    if (idle && indirect_.outstanding() > 0) next_look_ = std::min(next_look_, now_ + k_straggler_watch);
}

/// Whether it is left with nothing more to do though it could.
bool ClientMachine::hand_out_to(Server& server) {
    while (server.peer.accepts_work() && server.credits.available() &&
           server.credits.owed() < window_of(server)) {
        const std::size_t outstanding = indirect_.outstanding() + audit_.outstanding();
        if (outstanding >= most_leases(most_result_bytes())) return false;
        if (!grant_to(server)) return true;
    }
    return false;
}

std::uint64_t ClientMachine::most_result_bytes() const {
    return std::uint64_t(config_.block_size) * std::uint64_t(config_.block_size) * sizeof(PixelSum);
}

std::size_t ClientMachine::window_of(const Server& server) const {
    std::optional<TimeNs> lease_time = server.speed.predict(indirect_.samples_of_full_round());
    if (lease_time) *lease_time *= rounds_per_lease_of(server);
    return std::min(credit_window(server.round_trip, lease_time, server.at_once),
                    credit_share(most_result_bytes(), servers_.size()));
}

std::uint32_t ClientMachine::rounds_per_lease_of(const Server& server) const {
    // A filtered sum is not the sum of filtered rounds.
    if (job_.state.settings.filter == FilterPlace::server) return 1;
    return rounds_per_lease(config_.lease_time, server.speed.predict(indirect_.samples_of_full_round()),
                            indirect_.rounds_waiting(), std::max<std::uint64_t>(1, places_));
}

bool ClientMachine::grant_to(Server& server) {
    const ServerId id = server.peer.id();
    // What it owes comes first, so that counts into the time this round may take.
    const auto duration = [&](const Round& round, std::uint32_t attempts) {
        const double samples = double(round.samples()) * double(server.credits.owed() + 1);
        auto predicted = server.speed.predict(samples);
        if (predicted) *predicted = std::max(*predicted, server.turnaround.mean());
        return lease_duration(predicted, attempts);
    };
    std::optional<Lease> lease;
    // First: the sooner a liar is found, the less is to be undone.
    if (const auto item = next_audit(server))
        lease =
            grant_audit(*item, id, duration(work_.round_of(item->round.unit, item->samples), item->attempts));
    if (!lease) lease = indirect_.grant_indirect(id, now_, rounds_per_lease_of(server), duration);
    if (!lease && config_.schedule == ScheduleKind::pull && server.credits.owed() == 0)
        lease = grant_straggler(server);  // Nothing is open, but another may be late with its last rounds.
    if (!lease) return false;
    send_lease(server, *lease);
    return true;
}

std::optional<Lease> ClientMachine::grant_straggler(Server& server) {
    // Of its turnaround, the leases in front of it took a part.
    const std::size_t window = window_of(server);
    const std::size_t in_turn = window > server.at_once ? window - server.at_once + 1 : 1;
    const auto own = [&](double samples) {
        auto estimate = server.speed.predict(samples);
        if (estimate) *estimate = std::max(*estimate, server.turnaround.mean() / TimeNs(in_turn));
        return estimate;
    };
    const auto duration = [&](const Round& round, std::uint32_t) {
        return lease_duration(own(double(round.samples())), 1);
    };
    return indirect_.copy_straggler(server.peer.id(), now_, own, duration);
}

void ClientMachine::send_lease(Server& server, const Lease& lease) {
    const TimeNs duration = lease.deadline - now_;
    server.credits.take(lease.id, now_, lease.deadline + duration);
    server.allowance.give(1, now_);
    message::Lease message;
    message.session = session_;
    message.lease = lease.id;
    message.epoch = lease.epoch;
    message.strategy = std::string(name_of(strategy_));
    message.unit = lease.unit;
    message.rect = indirect_.round_of(lease).rect;
    message.first = lease.first;
    message.count = lease.count;
    message.lease_ms = std::uint32_t(std::clamp<TimeNs>(duration / k_millisecond_ns, 1, 3'600'000));
    if (send(Channel::frames, server.instance, std::move(message), server.peer.id())) return;
    // Not connected on frames, for the moment: its next CREDIT will tell that it is again.
    release(lease.id, server.peer.id());
    server.credits.settle(lease.id);
    server.credits.set_limit(0);
}

/// The client's next own round. Alone it renders both parts, which then grow evenly: of one round together wherever it
/// can; else direct light is all there is to do.
std::optional<ClientMachine::LocalWork> ClientMachine::next_local_work() {
    LocalWork work;
    const auto take_indirect = [&] {
        if (!announced_alone_) return;
        work.indirect = work_.grant_indirect(k_local_server, now_, 1,
                                             [](const Round&, std::uint32_t) { return k_no_deadline; });
    };
    if (work_.direct_is_behind()) work.direct = work_.grant_direct(now_);
    if (!work.direct) take_indirect();
    if (work.indirect)
        work.direct = work_.grant_direct_beside(*work.indirect, now_);
    else if (!work.direct)
        work.direct = work_.grant_direct(now_);
    if (!work.direct && !work.indirect) return std::nullopt;
    return work;
}

void ClientMachine::hand_out_locally() {
    while (local_work_.size() < k_local_rounds) {
        std::optional<LocalWork> work;
        const auto take_audit = [&](bool disputes_only) {
            const auto item = next_local_audit(disputes_only);
            if (!item) return;
            audit_.grant_to_client(item->round);
            work.emplace().audit = item;
        };
        take_audit(true);
        if (!work) work = next_local_work();
        if (!work) take_audit(false);
        if (!work) return;
        begin_local(*work);
    }
}

void ClientMachine::begin_local(LocalWork work) {
    work.epoch = work_.epoch();
    const std::uint64_t ticket = ++last_ticket_;
    const LightPart part = work.indirect || work.audit ? LightPart::indirect : LightPart::direct;
    const bool direct_too = work.indirect && work.direct;
    const Round round = work.audit ? work_.round_of(work.audit->round.unit, work.audit->samples)
                                   : work_.round_of(work.indirect ? *work.indirect : *work.direct);
    local_work_.emplace(ticket, std::move(work));
    world_.begin({ticket, part, round, job_.scene, job_.state.camera, job_.state.settings, direct_too,
                  config_.strategy});
}

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
        // Of rounds that were undone, results were on their way.
        const bool never_granted =
            (verdict == Verdict::unknown || verdict == Verdict::mismatched) && tile.lease > last_undone_;
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
