#include "pathscope/session/client_machine.hpp"

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

/// Of a lease, before it is packed.
std::uint64_t result_bytes(const IndirectWork& work) { return work.most_pixels() * sizeof(PixelSum); }

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
        if (outstanding >= most_leases(result_bytes(indirect_))) return false;
        if (!grant_to(server)) return true;
    }
    return false;
}

std::size_t ClientMachine::window_of(const Server& server) const {
    std::optional<TimeNs> lease_time = server.speed.predict(indirect_.samples_of_full_round());
    if (lease_time) *lease_time *= rounds_per_lease_of(server);
    return std::min(credit_window(server.round_trip, lease_time, server.at_once),
                    credit_share(result_bytes(indirect_), servers_.size()));
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
    const std::size_t window = window_of(server);
    const std::size_t in_turn = window > server.at_once ? window - server.at_once + 1 : 1;
    const auto own = [&](double samples) {
        auto estimate = server.speed.predict(samples);
        if (estimate) *estimate = server.turnaround.when_idle(*estimate, in_turn);
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

}  // namespace pathscope
