#include "pathscope/session/relay_machine.hpp"

#include <algorithm>

#include "pathscope/cluster/credit_policy.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_most_callers = 4096;
constexpr TimeNs k_caller_patience =
    10 * k_second_ns;  ///< A server that waits says HELLO every five seconds.
constexpr TimeNs k_who_pause = k_second_ns;
constexpr TimeNs k_look_pause = 50 * k_millisecond_ns;

/// A server that missed a state has it again after a heartbeat or two; for so long leases may wait here for the last one.
constexpr TimeNs k_longest_wait = 2 * k_second_ns;

/// A relay looks at no triangle.
std::shared_ptr<const Scene> no_scene() {
    static const auto scene = std::make_shared<const Scene>();
    return scene;
}

/// What does not change from frame to frame, and what is the business of whoever has a frame.
ClientConfig config_below(ClientConfig config) {
    config.listens = true;
    config.local_servers = config.min_servers = 0;
    config.relaxed = false;
    config.strategy = Strategy::blocks;
    config.schedule = ScheduleKind::pull;
    config.audit = {};
    config.time_limit = 0;
    return config;
}

}  // namespace

RelayMachine::RelayMachine(ServerIdentity identity, SceneCache cache, const ClientConfig& below,
                           std::uint64_t session, EventStore& store, RelayWorld& world)
    : config_(config_below(below)),
      session_(session),
      store_(store),
      world_(world),
      work_(&store),
      above_(std::move(identity), std::move(cache), above_world_) {}

// ---- The worlds of both machines.

bool RelayMachine::AboveWorld::send(Channel channel, Frames&& frames) {
    return relay.world_.send_up(channel, std::move(frames));
}

void RelayMachine::AboveWorld::begin(RoundJob job) {
    relay.below_->set_strategy(job.strategy);
    relay.work_.begin(std::move(job), relay.above_.now());
}

void RelayMachine::AboveWorld::cancel(std::uint64_t ticket) {
    relay.withdraw(relay.work_.cancel(ticket, relay.above_.now()));
}

void RelayMachine::AboveWorld::cancel_all() { relay.withdraw(relay.work_.cancel_all(relay.above_.now())); }

std::uint64_t RelayMachine::AboveWorld::work_done() const {
    return relay.work_.rounds_committed() + (relay.below_ ? relay.below_->work_seen() : 0);
}

bool RelayMachine::AboveWorld::works_on(std::uint64_t ticket) const { return relay.work_.has_begun(ticket); }

void RelayMachine::AboveWorld::on_state(const RenderState& state) {
    relay.pass_down(state, relay.above_.now());
}

void RelayMachine::AboveWorld::load(RenderState state, Manifest manifest) {
    relay.world_.check_scene(std::move(state), std::move(manifest));
}

bool RelayMachine::BelowWorld::send(Channel channel, const std::string& instance, Frames frames) {
    return relay.world_.send_down(channel, instance, std::move(frames));
}

void RelayMachine::BelowWorld::publish(Frames frames) { relay.world_.publish_down(std::move(frames)); }

void RelayMachine::BelowWorld::begin(RoundJob job) { CHECK(false, job.ticket); }

void RelayMachine::withdraw(const std::vector<Lease>& leases) {
    if (below_) below_->withdraw(leases);
}

// ---- The state, on its way down.

const SceneDepot& RelayMachine::depot_of(const RenderState& state) const {
    const auto found = std::find_if(depots_.begin(), depots_.end(),
                                    [&](const auto& depot) { return depot.first == state.files; });
    CHECK(found != depots_.end());
    return found->second;
}

void RelayMachine::pass_down(RenderState state, TimeNs now) {
    const SceneDepot& depot = depot_of(state);
    state.files = depot.manifest_hash();
    state.settings.wire = WireFormat::exact;
    if (below_) {
        if (state == below_->state()) return;
        below_->change_scene(std::move(state), no_scene(), depot, now);
        return work_.begin_epoch(below_->epoch(), now);
    }
    below_.emplace(config_, ClientJob{std::move(state), no_scene(), depot}, session_, store_, below_world_,
                   now, &work_);
    for (auto& [instance, caller] : std::exchange(callers_, {}))
        if (!caller.hello.empty())
            below_->on_message(instance, std::move(caller.hello), Channel::monitor, now, caller.sender);
}

/// Servers below may begin to load; the client above is told that the scene is there when one of them has.
void RelayMachine::on_checked(CheckedScene& checked, TimeNs now) {
    now_ = now;
    if (!checked.depot) {
        LoadedScene loaded{std::move(checked.state), checked.depot.error()};
        return above_.on_loaded(loaded, now_);
    }
    // The client may go back to the scene that is here, however many others it asked for in between.
    std::erase_if(depots_, [&](const auto& depot) {
        return depot.first == checked.state.files || !above_.has_scene(depot.first);
    });
    depots_.emplace_back(checked.state.files, std::move(*checked.depot));
    to_load_.emplace(LoadedScene{checked.state, no_scene()});
    // Without a client nobody below can be asked to load it, and the next client's scene must not wait for that. Or the relay
    // is at work again on the scene that it had, while this one was looked at.
    if (!above_.linked() || above_.working_on()) return tell_loaded(true);
    pass_down(std::move(checked.state), now_);
}

void RelayMachine::tell_loaded(bool in_step) {
    if (!to_load_ || (above_.linked() && below_ && !in_step)) return;
    LoadedScene loaded = std::move(*to_load_);
    to_load_.reset();
    above_.on_loaded(loaded, now_);
}

// ---- Below.

void RelayMachine::on_message(const std::string& instance, Frames frames, Channel channel, TimeNs now,
                              const Sender& sender) {
    now_ = now;
    if (below_) return below_->on_message(instance, std::move(frames), channel, now, sender);
    keep_caller(instance, std::move(frames), channel, sender);
}

/// Who says HELLO too early is answered as soon as there is a state to welcome it with.
void RelayMachine::keep_caller(const std::string& instance, Frames frames, Channel channel,
                               const Sender& sender) {
    Decoded decoded = decode(std::move(frames), Role::client, channel);
    if (!decoded || (callers_.size() >= k_most_callers && !callers_.contains(instance))) return;
    if (std::holds_alternative<message::Hello>(*decoded)) {
        callers_.insert_or_assign(instance, Caller{encode(std::move(*decoded)), sender, now_});
        return;
    }
    // A server of the relay that ran here before: it shall begin anew.
    Caller& caller = callers_.try_emplace(instance).first->second;
    if (!caller.hello.empty() || (caller.at != 0 && now_ - caller.at < k_who_pause)) return;
    caller.at = now_;
    world_.send_down(Channel::monitor, instance, encode(message::Who{}));
}

void RelayMachine::on_connection_lost(TimeNs now) {
    now_ = now;
    if (below_) below_->on_connection_lost(now);
}

void RelayMachine::on_revoked(const std::string& instance, std::string_view why, TimeNs now) {
    now_ = now;
    callers_.erase(instance);
    if (below_) below_->on_revoked(instance, why, now);
}

void RelayMachine::on_own_pause(TimeNs pause) {
    if (below_) below_->on_own_pause(pause);
}

// ---- Time.

bool RelayMachine::wants_client(TimeNs now) const {
    if (below_) return any_ready_;
    return std::any_of(callers_.begin(), callers_.end(), [now](const auto& caller) {
        return !caller.second.hello.empty() && now - caller.second.at < k_caller_patience;
    });
}

void RelayMachine::on_timers(TimeNs now) {
    now_ = now;
    if (below_) below_->on_timers(now_);
    for (RoundOutcome& outcome : work_.take_finished()) above_.on_outcome(outcome, now_);
    if (now_ >= next_look_) look_at_servers();
    above_.on_timers(now_);
}

TimeNs RelayMachine::next_timer(TimeNs now) const {
    const TimeNs next = std::min(above_.next_timer(now), next_look_);
    return std::max(now, below_ ? std::min(next, below_->next_timer(now)) : next);
}

/// Who stands for nobody leaves.
void RelayMachine::look_at_servers() {
    next_look_ = now_ + k_look_pause;
    const bool any = below_ ? below_->progress().servers_known > 0 : wants_client(now_);
    if (!below_)
        std::erase_if(callers_,
                      [this](const auto& caller) { return now_ - caller.second.at >= k_caller_patience; });
    any_ready_ = below_ && below_->progress().servers_ready > 0;
    const bool in_step = below_ && below_->servers_in_step() > 0;
    tell_loaded(in_step);
    if (any_ready_ || !above_.working_on()) last_ready_ = now_;
    if (below_)
        at_once_ = std::clamp(work_.leases_for(below_->leases_wanted()), 1u, std::uint32_t(k_most_credits));
    if (!above_.linked()) return;
    if (!any)
        above_.leave("No server is left.", now_);
    else if (now_ - last_ready_ >= k_longest_wait)
        above_.leave("No server is ready.", now_);
}

void RelayMachine::say_goodbye(TimeNs now) {
    now_ = now;
    if (above_.linked()) above_.say_goodbye(now_);
    if (below_) below_->say_goodbye(now_);
}

}  // namespace pathscope
