#include "simulated_cluster.hpp"

#include <cmath>
#include <cstring>

#include "simulated_processes.hpp"

namespace pathscope::testing {
namespace {

/// After the end: late messages still come, states settle. `fixed` takes 12 s, and as long as the client was paused, to see a
/// death.
constexpr TimeNs k_epilogue = 10 * k_second_ns;
constexpr TimeNs k_slow_epilogue = 30 * k_second_ns;
constexpr TimeNs k_longest_run = 5'000 * k_second_ns;

const SceneFile& scene_file() {
    static const SceneFile file = *parse_scene_file(
        R"({"name": "simulated", "obj": "simulated.obj", "up_axis": "Y",
            "camera": {"position": [0, 0, 4], "look_at": [0, 0, 0], "up": [0, 1, 0], "vfov_deg": 40},
            "lights": [{"type": "sphere", "centre": [0, 0, 0], "radius": 1, "radiance": [1, 1, 1]}]})",
        "simulated.json");
    return file;
}

}  // namespace

SimulatedCluster::SimulatedCluster(const ClusterSettings& settings)
    : settings_(settings), rng_(hash_u32(settings.seed) ^ 0x5eedu) {}
SimulatedCluster::~SimulatedCluster() = default;

std::string SimulatedCluster::new_instance() {
    std::string instance(16, '\1');
    ++instances_;
    std::memcpy(instance.data() + 1, &instances_, sizeof instances_);
    return instance;
}

void SimulatedCluster::start_client() {
    RenderState state = client_ ? client_->machine().state() : RenderState{};
    if (!client_) {
        state.scene = scene_file();
        state.camera = state.scene.cameras.front().view;
        state.settings.width = settings_.width;
        state.settings.height = settings_.height;
        state.settings.spp = settings_.spp;
        state.settings.direct_spp = settings_.direct_spp;
        state.settings.seed = settings_.seed;
    } else {
        count_client();
    }
    if (client_) client_->kill();
    clients_.push_back(std::make_unique<Client>(*this, std::move(state), ++sessions_));
    client_ = clients_.back().get();
    last_progress_ = time_.now();
    for (const auto& server : servers_)
        if (server->relay() == k_no_relay) tell_lost(*server);
    for (const auto& relay : relays_)
        if (relay->relay() == k_no_relay) tell_lost(*relay);
}

/// The process at the other end is gone. What it sent is heard first.
void SimulatedCluster::tell_lost(Dialler& who) {
    time_.at(std::max({time_.now(), who.parted_until(), who.from_client[1].last_arrival}) + 1,
             [&who] { who.when_awake([&who] { who.connection_lost(); }); });
}

void SimulatedCluster::start_relay(int number, int relay) {
    auto started = std::make_unique<Relay>(*this, number, relay);
    if (number == int(relays_.size())) return relays_.push_back(std::move(started));
    std::swap(relays_[std::size_t(number)], started);
    dead_relays_.push_back(std::move(started));
    for (const auto& server : servers_)
        if (server->relay() == number) tell_lost(*server);
    for (const auto& other : relays_)
        if (other->relay() == number) tell_lost(*other);
}

void SimulatedCluster::publish(int relay, const Frames& frames) {
    for (const auto& server : servers_)
        if (server->relay() == relay) (void)to_server(Channel::input, server->instance(), frames);
    for (const auto& other : relays_)
        if (other->relay() == relay) (void)to_server(Channel::input, other->instance(), frames);
}

/// What happened to a client that is about to end.
void SimulatedCluster::count_client() {
    const EventStore& store = client_->store();
    totals_.bad_messages += store.total(Counter::bad_messages);
    totals_.deaths += store.total(Counter::died);
    totals_.bans += store.total(Counter::banned);
    totals_.audited += store.total(Counter::rounds_audited);
    totals_.unmasked += store.total(Counter::audits_differing);
    totals_.undone += store.total(Counter::rounds_undone);
    totals_.stuck += store.total(Counter::stuck);
}

void SimulatedCluster::start_server() {
    const double speed = settings_.samples_per_second * std::exp2(6 * uniform() - 3);
    const bool differs = settings_.differing > 0 && chance(settings_.differing);
    const int relay = relays_.empty() || chance(0.2) ? k_no_relay : int(rng_.next_u32() % relays_.size());
    servers_.push_back(
        std::make_unique<Server>(*this, std::uint32_t(servers_.size() + 1), speed, differs, relay));
}

void SimulatedCluster::plan_hang(TimeNs at, TimeNs duration) {
    time_.at(at, [this, duration] {
        for (const auto& server : servers_) server->hang(time_.now() + duration);
        ++totals_.hangs;
    });
}

template <class Arrive>
void SimulatedCluster::transmit(Wire& wire, Dialler& dialler, Frames frames, Arrive arrive) {
    ++totals_.messages;
    if (dialler.parted()) {
        ++totals_.parted;
        return;
    }
    int copies = 1;
    if (!calm()) {
        if (chance(settings_.lose)) {
            ++totals_.lost;
            return;
        }
        if (chance(settings_.damage)) {
            ++totals_.damaged;
            frames = damaged(std::move(frames));
        }
        if (chance(settings_.duplicate)) {
            ++totals_.doubled;
            copies = 2;
        }
    }
    // Mostly well below a millisecond, at times much longer: the order between peers is free, that of a wire is not.
    for (int i = 0; i < copies; ++i) {
        const TimeNs arrival = time_.now() + 100'000 + soon(chance(0.03) ? 0.3 : 0.002);
        wire.last_arrival = std::max(wire.last_arrival, arrival);
        time_.at(wire.last_arrival, [arrive, frames] { arrive(frames); });
    }
}

Frames SimulatedCluster::damaged(Frames frames) {
    std::string& frame = frames[rng_.next_u32() % frames.size()];
    if (!frame.empty()) {
        char& byte = frame[rng_.next_u32() % frame.size()];
        byte = char(byte ^ 1 << rng_.next_u32() % 8);
    }
    return frames;
}

/// Or to the relay that it dials.
void SimulatedCluster::to_client(Dialler& dialler, Channel channel, Frames frames) {
    const auto arrive = [this, channel, relay = dialler.relay(), instance = dialler.instance(),
                         sender = dialler.sender()](const Frames& arrived) {
        if (relay == k_no_relay)
            return client_->when_awake([=, this] { client_->receive(instance, channel, arrived, sender); });
        Relay* const there = relays_[std::size_t(relay)].get();
        there->when_awake([=] { there->receive(instance, channel, arrived, sender); });
    };
    transmit(dialler.from_server[int(channel)], dialler, std::move(frames), arrive);
}

bool SimulatedCluster::to_server(Channel channel, const std::string& instance, Frames frames) {
    const auto is_it = [&](const auto& dialler) { return dialler->reachable_as(instance); };
    Dialler* dialler = nullptr;
    if (const auto server = std::find_if(servers_.begin(), servers_.end(), is_it); server != servers_.end())
        dialler = server->get();
    else if (const auto relay = std::find_if(relays_.begin(), relays_.end(), is_it); relay != relays_.end())
        dialler = relay->get();
    if (!dialler) {
        ++totals_.unreachable;
        return false;
    }
    const auto arrive = [dialler, channel, instance](const Frames& arrived) {
        dialler->when_awake([=] { dialler->receive(instance, channel, arrived); });
    };
    transmit(dialler->from_client[int(channel)], *dialler, std::move(frames), arrive);
    return true;
}

void SimulatedCluster::plan_faults() {
    const auto sometime = [&] { return from_seconds(uniform() * to_seconds(settings_.calm_at)); };
    // Somebody drags the camera: several states, one soon after the other.
    for (int drags = std::exchange(settings_.new_states, 0); drags > 0; --drags) {
        const TimeNs begun = sometime();
        const int steps = 1 + int(rng_.next_u32() % 6);
        settings_.new_states += steps;
        for (int step = 0; step < steps; ++step)
            time_.at(begun + step * 15 * k_millisecond_ns, [this] { move_camera(); });
    }
    for (int i = 0; i < settings_.restarts; ++i)
        time_.at(sometime(), [this] {
            ++totals_.restarts;
            --settings_.restarts;
            start_client();
        });
    if (settings_.faults_per_second > 0) time_.at(soon(1), [this] { strike(); });
}

void SimulatedCluster::move_camera() {
    // A paused client's frame may be done, and is not the last: this state is still to come.
    if (client_->frozen()) return time_.at(time_.now() + 15 * k_millisecond_ns, [this] { move_camera(); });
    --settings_.new_states;
    client_->when_awake([this] {
        RenderState state = client_->machine().state();
        ++state.settings.seed;
        if (chance(0.3))
            state.settings.width = std::max(1, state.settings.width + int(rng_.next_u32() % 5) - 2);
        ++totals_.new_states;
        client_->change_state(std::move(state));
    });
}

void SimulatedCluster::strike() {
    if (calm()) return;
    time_.at(time_.now() + from_seconds(-std::log(1 - uniform()) / settings_.faults_per_second),
             [this] { strike(); });
    if (chance(0.05)) {
        ++totals_.pauses;
        return client_->pause(soon(3));
    }
    if (chance(0.25) && int(servers_.size()) < settings_.most_servers) {
        ++totals_.joins;
        return start_server();
    }
    if (!relays_.empty() && chance(0.2)) return strike_relay();
    if (servers_.empty()) return;
    Server& server = *servers_[rng_.next_u32() % servers_.size()];
    if (!server.runs()) return;
    const double kind = uniform();
    const TimeNs until = std::min(time_.now() + soon(10), settings_.calm_at);
    if (kind < 0.2) {
        ++totals_.kills;
        server.kill();
        // Its connections close, and that is told soon; unless the cable is cut as well.
        if (!server.parted()) hang_up(server.relay());
    } else if (kind < 0.5) {
        ++totals_.freezes;
        server.freeze(until);
    } else if (kind < 0.75) {
        ++totals_.partitions;
        server.part(until);
    } else if (kind < 0.87) {
        ++totals_.hangs;
        server.hang(settings_.calm_at);
    } else {
        ++totals_.drains;
        server.when_awake([&server] { server.drain(); });
    }
}

/// The client, or a relay, is told soon that some connection ended.
void SimulatedCluster::hang_up(int relay) {
    time_.at(time_.now() + soon(0.005), [this, relay] {
        if (relay == k_no_relay) return client_->when_awake([this] { client_->connection_lost(); });
        Relay* const there = relays_[std::size_t(relay)].get();
        there->when_awake([there] { there->server_lost(); });
    });
}

/// A relay that died or left is started again before long.
void SimulatedCluster::strike_relay() {
    Relay& relay = *relays_[rng_.next_u32() % relays_.size()];
    if (!relay.runs()) return;
    ++totals_.relay_faults;
    const double kind = uniform();
    const TimeNs until = std::min(time_.now() + soon(10), settings_.calm_at);
    if (kind < 0.3) return relay.pause(until - time_.now());
    if (kind < 0.6) return relay.part(until);
    if (kind < 0.8) {
        relay.kill();
        if (!relay.parted()) hang_up(relay.relay());
    } else {
        relay.when_awake([&relay] { relay.drain(); });
    }
    time_.at(time_.now() + soon(2), [this, &relay] { restart_relay(relay); });
}

void SimulatedCluster::restart_relay(Relay& relay) {
    if (relay.runs())  // It drains.
        return time_.at(time_.now() + 100 * k_millisecond_ns, [this, &relay] { restart_relay(relay); });
    start_relay(relay.number(), relay.relay());
}

TimeNs SimulatedCluster::end_of_bans(TimeNs after) const {
    TimeNs end = 0;
    const auto look = [&](const Dialler& dialler) {
        const ClientMachine* const host =
            dialler.relay() == k_no_relay ? &client_->machine()
                                          : relays_[std::size_t(dialler.relay())]->relay_machine().below();
        if (!host) return;
        if (const auto ban = host->conduct().ban_of(dialler.conduct_name(), after))
            end = std::max(end, ban->until);
    };
    for (const auto& server : servers_) look(*server);
    for (const auto& relay : relays_) look(*relay);
    return end;
}

std::string SimulatedCluster::run() {
    start_client();
    for (int i = 0; i < settings_.relays; ++i)
        start_relay(i, i > 0 && chance(0.3) ? int(rng_.next_u32() % std::uint32_t(i)) : k_no_relay);
    for (int i = 0; i < settings_.servers; ++i) start_server();
    plan_faults();

    const TimeNs epilogue = settings_.detector == DetectorKind::fixed ? k_slow_epilogue : k_epilogue;
    TimeNs end = k_longest_run;
    while (failure_.empty() && !time_.empty()) {
        // Who is banned comes back by itself, and has its time for that.
        if (time_.next() > end) end = std::max(end, end_of_bans(time_.now() - epilogue) + epilogue);
        if (time_.next() > end) break;
        time_.step();
        ++totals_.events;
        check_pace();
        check_all();
        if (!done())
            end = k_longest_run;  // A new state that the client heard of only after a pause.
        else if (end == k_longest_run)
            end = std::max(time_.now(), settings_.calm_at) + epilogue;
    }
    if (failure_.empty()) check_end();
    totals_.virtual_time = time_.now();
    totals_.ledger = client_->machine().work().indirect_ledger().counts();
    count_client();
    return failure_;
}

}  // namespace pathscope::testing
