#include "simulated_cluster.hpp"

#include <fmt/format.h>

#include <cmath>

#include "pathscope/core/check.hpp"
#include "pathscope/session/build_identity.hpp"

namespace pathscope::testing {
namespace {

/// After the end: late messages still come, states settle. `fixed` takes 12 s, and as long as the client was paused, to see a
/// death.
constexpr TimeNs k_epilogue = 10 * k_second_ns;
constexpr TimeNs k_slow_epilogue = 30 * k_second_ns;
constexpr TimeNs k_dial_time = 20 * k_millisecond_ns;
/// Without progress though someone could work. Leases that are lost time out one after the other, each later.
constexpr TimeNs k_longest_wait = 150 * k_second_ns;
constexpr TimeNs k_longest_run = 5'000 * k_second_ns;
constexpr std::uint64_t k_most_at_once = 100'000;  ///< Events within a millisecond; more, and somebody spins.

const SceneFile& scene_file() {
    static const SceneFile file = *parse_scene_file(
        R"({"name": "simulated", "obj": "simulated.obj", "up_axis": "Y",
            "camera": {"position": [0, 0, 4], "look_at": [0, 0, 0], "up": [0, 1, 0], "vfov_deg": 40},
            "lights": [{"type": "sphere", "centre": [0, 0, 0], "radius": 1, "radiance": [1, 1, 1]}]})",
        "simulated.json");
    return file;
}

}  // namespace

// ---- Settings and totals.

ClusterSettings ClusterSettings::from_seed(std::uint32_t seed) {
    HashRng rng(seed);
    const auto below = [&](std::uint32_t n) { return rng.next_u32() % n; };
    const auto often = [&](std::uint32_t one_in) { return below(one_in) == 0; };
    ClusterSettings s;
    s.seed = seed;
    s.servers = int(often(50) ? 20 + below(60) : below(7));
    if (seed % 1000 == 0) s.servers = seed % 10'000 == 0 ? 1000 : int(100 + below(100));
    s.most_servers = s.servers + int(below(6));
    s.width = 3 + int(below(14));
    s.height = 3 + int(below(10));
    s.block = 2 + int(below(6));
    s.spp = 1 + below(12);
    s.direct_spp = 1 + below(3);
    s.round_samples = 1 + below(4);
    s.schedule = k_schedule_names[below(k_schedule_names.size())].value;
    s.detector = often(4) ? DetectorKind::fixed : DetectorKind::adaptive;
    s.min_servers = often(3) ? 1 : 0;
    s.samples_per_second = std::exp2(7 + 6.0 * rng.next_float());
    s.lose = often(2) ? 0.2f * rng.next_float() : 0;
    s.duplicate = often(2) ? 0.2f * rng.next_float() : 0;
    s.damage = often(3) ? 0.1f * rng.next_float() : 0;
    s.faults_per_second = often(4) ? 0 : 3.0 * rng.next_float();
    s.new_states = int(below(3));
    s.restarts = often(5) ? 1 : 0;
    s.calm_at = from_seconds(2 + 8 * rng.next_float());
    if (s.servers >= 100) {  // A crowd: what matters is that it is one.
        s.detector = DetectorKind::adaptive;
        s.faults_per_second *= 5;
        s.width = s.height = 24;
        s.new_states = 1;
        s.calm_at = 2 * k_second_ns;
    }
    return s;
}

std::string ClusterSettings::describe() const {
    return fmt::format(
        "{} servers, {}x{} in blocks of {}, {}+{} samples in rounds of {}, {}, {}, at least {}, lose {:.2f}, "
        "duplicate {:.2f}, damage {:.2f}, {:.1f} faults/s, {} states, {} restarts, calm at {:.1f} s",
        servers, width, height, block, spp, direct_spp, round_samples, name_of(schedule), name_of(detector),
        min_servers, lose, duplicate, damage, faults_per_second, new_states, restarts, to_seconds(calm_at));
}

void ClusterTotals::add(const ClusterTotals& other) {
    events += other.events;
    messages += other.messages;
    lost += other.lost;
    doubled += other.doubled;
    damaged += other.damaged;
    parted += other.parted;
    unreachable += other.unreachable;
    kills += other.kills;
    freezes += other.freezes;
    partitions += other.partitions;
    drains += other.drains;
    joins += other.joins;
    pauses += other.pauses;
    restarts += other.restarts;
    new_states += other.new_states;
    bad_messages += other.bad_messages;
    deaths += other.deaths;
    virtual_time += other.virtual_time;
    ledger.granted += other.ledger.granted;
    ledger.accepted += other.ledger.accepted;
    ledger.late += other.ledger.late;
    ledger.duplicates += other.ledger.duplicates;
    ledger.stale += other.ledger.stale;
    ledger.unknown += other.ledger.unknown;
    ledger.mismatched += other.ledger.mismatched;
    ledger.superseded += other.ledger.superseded;
    ledger.released += other.ledger.released;
    ledger.expired += other.ledger.expired;
    ledger.revoked += other.ledger.revoked;
    ledger.dropped += other.ledger.dropped;
    ledger.reallocated += other.ledger.reallocated;
    ledger.copied += other.ledger.copied;
}

// ---- A process: it runs, or is frozen, and has a timer.

namespace {

class Process {
  public:
    explicit Process(VirtualTime& time) : time_(time) {}
    virtual ~Process() = default;

    [[nodiscard]] bool frozen() const { return time_.now() < frozen_until_; }
    void freeze(TimeNs until) { frozen_until_ = std::max(frozen_until_, until); }

    /// Lets something happen to the process: when it is thawed, and if it still lives.
    void when_awake(std::function<void()> happens) {
        if (frozen())
            return time_.at(frozen_until_,
                            [this, happens = std::move(happens)] { when_awake(std::move(happens)); });
        if (!runs_) return;
        happens();
        if (runs_) settle();
    }

    [[nodiscard]] bool runs() const { return runs_; }
    void kill() { runs_ = false; }

  protected:
    /// After everything that happens: what is due, and the next timer.
    void settle() {
        on_timers();
        if (!runs_) return;
        const TimeNs next = std::max(next_timer(), time_.now() + 1);
        if (planned_ > time_.now() && planned_ <= next) return;
        planned_ = next;
        time_.at(next, [this, next] {
            if (planned_ == next) when_awake([] {});
        });
    }
    virtual void on_timers() = 0;
    [[nodiscard]] virtual TimeNs next_timer() const = 0;

    VirtualTime& time_;

  private:
    bool runs_ = true;
    TimeNs frozen_until_ = 0;
    TimeNs planned_ = 0;
};

}  // namespace

class SimulatedCluster::Client : public Process, private ClientWorld {
  public:
    Client(SimulatedCluster& cluster, RenderState state, std::uint64_t session)
        : Process(cluster.time_),
          cluster_(cluster),
          renderer_(cluster.time_, cluster.settings_.samples_per_second,
                    [this](RoundOutcome& outcome) {
                        when_awake([this, outcome]() mutable { machine_.on_outcome(outcome, time_.now()); });
                    }),
          machine_(config(cluster.settings_), {std::move(state), nullptr, SceneDepot()}, session, store_,
                   *this, cluster.time_.now()) {
        settle();
    }

    void receive(const std::string& instance, Channel channel, Frames frames) {
        machine_.on_message(instance, std::move(frames), channel, time_.now());
    }
    void connection_lost() { machine_.on_connection_lost(time_.now()); }
    void change_state(RenderState state) { machine_.change_state(std::move(state), nullptr, time_.now()); }
    void pause(TimeNs duration) {
        freeze(time_.now() + duration);
        when_awake([this, duration] {
            if (duration > k_second_ns) machine_.on_own_pause(duration);
        });
    }

    [[nodiscard]] const ClientMachine& machine() const { return machine_; }
    [[nodiscard]] const EventStore& store() const { return store_; }

  private:
    static ClientConfig config(const ClusterSettings& settings) {
        ClientConfig config;
        config.listens = true;
        config.min_servers = settings.servers > 0 ? settings.min_servers : 0;
        config.schedule = settings.schedule;
        config.detector = settings.detector;
        config.block_size = settings.block;
        config.round_samples = settings.round_samples;
        return config;
    }

    bool send(Channel channel, const std::string& instance, Frames frames) override {
        return cluster_.to_server(channel, instance, std::move(frames));
    }
    void publish(Frames frames) override;
    void begin(RoundJob job) override { renderer_.begin(std::move(job)); }
    void cancel_all() override { renderer_.cancel_all(); }

    void on_timers() override { machine_.on_timers(time_.now()); }
    [[nodiscard]] TimeNs next_timer() const override { return machine_.next_timer(time_.now()); }

    SimulatedCluster& cluster_;
    EventStore store_;
    SimulatedRenderer renderer_;
    ClientMachine machine_;
};

class SimulatedCluster::Server : public Process, private ServerWorld {
  public:
    Server(SimulatedCluster& cluster, std::uint32_t pid, double samples_per_second)
        : Process(cluster.time_),
          cluster_(cluster),
          machine_({fmt::format("server-{}", pid), "0", std::string(build_identity()), 1, pid, "client"},
                   SceneCache({}), *this),
          renderer_(cluster.time_, samples_per_second, [this](RoundOutcome& outcome) {
              when_awake([this, outcome]() mutable { machine_.on_outcome(outcome, time_.now()); });
          }) {
        dial();
    }

    void receive(const std::string& instance, Channel channel, Frames frames) {
        if (instance == instance_ && machine_.linked())
            machine_.on_message(std::move(frames), channel, time_.now());
    }
    /// SIGTERM.
    void drain() {
        if (std::exchange(draining_, true)) return;
        machine_.drain(time_.now());
    }
    void part(TimeNs until) { parted_until_ = std::max(parted_until_, until); }
    [[nodiscard]] bool parted() const { return time_.now() < parted_until_; }
    [[nodiscard]] bool draining() const { return draining_; }
    [[nodiscard]] bool reachable_as(const std::string& instance) const {
        return runs() && instance == instance_ && machine_.linked();
    }
    [[nodiscard]] const std::string& instance() const { return instance_; }
    [[nodiscard]] const ServerMachine& machine() const { return machine_; }

    Wire from_client[3], from_server[3];

  private:
    void dial() {
        instance_ = cluster_.new_instance();
        const std::string instance = instance_;
        time_.at(time_.now() + k_dial_time, [this, instance] {
            when_awake([this, instance] { machine_.on_linked(instance, time_.now()); });
        });
    }

    bool send(Channel channel, Frames frames) override {
        cluster_.to_client(*this, channel, std::move(frames));
        return true;
    }
    void begin(RoundJob job) override { renderer_.begin(std::move(job)); }
    void cancel(std::uint64_t ticket) override { renderer_.cancel(ticket); }
    void cancel_all() override { renderer_.cancel_all(); }
    void load(RenderState state, Manifest) override {
        time_.at(time_.now() + 30 * k_millisecond_ns, [this, state = std::move(state)] {
            when_awake([this, state] {
                LoadedScene loaded{state, std::make_shared<const Scene>()};
                machine_.on_loaded(loaded, time_.now());
            });
        });
    }

    void on_timers() override {
        const bool was_linked = machine_.linked();
        machine_.on_timers(time_.now());
        if (draining_ && machine_.linked() && machine_.drained()) machine_.say_goodbye(time_.now());
        if (machine_.ended() || (draining_ && machine_.drained())) return kill();
        if (was_linked && !machine_.linked()) dial();
    }
    [[nodiscard]] TimeNs next_timer() const override { return machine_.next_timer(time_.now()); }

    SimulatedCluster& cluster_;
    std::string instance_;
    bool draining_ = false;
    TimeNs parted_until_ = 0;
    ServerMachine machine_;
    SimulatedRenderer renderer_;
};

void SimulatedCluster::Client::publish(Frames frames) {
    for (const auto& server : cluster_.servers_)
        (void)cluster_.to_server(Channel::input, server->instance(), frames);
}

// ---- The world.

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
        totals_.bad_messages += client_->store().total(Counter::bad_messages);
        totals_.deaths += client_->store().total(Counter::died);
    }
    if (client_) client_->kill();
    clients_.push_back(std::make_unique<Client>(*this, std::move(state), ++sessions_));
    client_ = clients_.back().get();
    last_progress_ = time_.now();
}

void SimulatedCluster::start_server() {
    const double speed = settings_.samples_per_second * std::exp2(6 * uniform() - 3);
    servers_.push_back(std::make_unique<Server>(*this, std::uint32_t(servers_.size() + 1), speed));
}

template <class Arrive>
void SimulatedCluster::transmit(Wire& wire, Server& server, Frames frames, Arrive arrive) {
    ++totals_.messages;
    if (server.parted()) {
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

void SimulatedCluster::to_client(Server& server, Channel channel, Frames frames) {
    const auto arrive = [this, channel, instance = server.instance()](const Frames& arrived) {
        client_->when_awake([=, this] { client_->receive(instance, channel, arrived); });
    };
    transmit(server.from_server[int(channel)], server, std::move(frames), arrive);
}

bool SimulatedCluster::to_server(Channel channel, const std::string& instance, Frames frames) {
    const auto found = std::find_if(servers_.begin(), servers_.end(),
                                    [&](const auto& server) { return server->reachable_as(instance); });
    if (found == servers_.end()) {
        ++totals_.unreachable;
        return false;
    }
    Server* const server = found->get();
    const auto arrive = [server, channel, instance](const Frames& arrived) {
        server->when_awake([=] { server->receive(instance, channel, arrived); });
    };
    transmit(server->from_client[int(channel)], *server, std::move(frames), arrive);
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
    if (servers_.empty()) return;
    Server& server = *servers_[rng_.next_u32() % servers_.size()];
    if (!server.runs()) return;
    const double kind = uniform();
    const TimeNs until = std::min(time_.now() + soon(10), settings_.calm_at);
    if (kind < 0.25) {
        ++totals_.kills;
        server.kill();
        // Its connections close, and that is told soon; unless the cable is cut as well.
        if (!server.parted())
            time_.at(time_.now() + soon(0.005),
                     [this] { client_->when_awake([this] { client_->connection_lost(); }); });
    } else if (kind < 0.6) {
        ++totals_.freezes;
        server.freeze(until);
    } else if (kind < 0.85) {
        ++totals_.partitions;
        server.part(until);
    } else {
        ++totals_.drains;
        server.when_awake([&server] { server.drain(); });
    }
}

std::string SimulatedCluster::run() {
    start_client();
    for (int i = 0; i < settings_.servers; ++i) start_server();
    plan_faults();

    TimeNs end = k_longest_run;
    while (!time_.empty() && time_.next() <= end && failure_.empty()) {
        time_.step();
        ++totals_.events;
        check_pace();
        check_all();
        if (done() && end == k_longest_run)
            end = std::max(time_.now(), settings_.calm_at) +
                  (settings_.detector == DetectorKind::fixed ? k_slow_epilogue : k_epilogue);
    }
    if (failure_.empty()) check_end();
    totals_.virtual_time = time_.now();
    totals_.ledger = client_->machine().work().indirect_ledger().counts();
    totals_.bad_messages += client_->store().total(Counter::bad_messages);
    totals_.deaths += client_->store().total(Counter::died);
    return failure_;
}

// ---- The oracle.

void SimulatedCluster::fail(std::string why) {
    if (failure_.empty()) failure_ = fmt::format("at {:.6f} s: {}", to_seconds(time_.now()), why);
}

bool SimulatedCluster::done() const {
    return client_->machine().complete() && settings_.new_states == 0 && settings_.restarts == 0;
}

bool SimulatedCluster::someone_can_work() const {
    if (client_->frozen()) return false;
    // A client that waits for servers works as soon as one is there; the others carry on alone.
    const bool waits = client_->machine().progress().waiting;
    return !waits || std::any_of(servers_.begin(), servers_.end(), [](const auto& server) {
        return server->runs() && !server->frozen() && !server->parted() && !server->draining();
    });
}

void SimulatedCluster::check_all() {
    const FrameWork& work = client_->machine().work();
    if (const auto audit = work.indirect_ledger().audit(); !audit) fail(audit.error().message);
    for (const auto& server : servers_)
        if (server->machine().leases() > 2 || server->machine().unsent_answers() > 4)
            fail(fmt::format("a server holds {} leases and {} unsent answers", server->machine().leases(),
                             server->machine().unsent_answers()));
    check_progress();
}

/// A timer that is always due is a process that takes a core and does nothing.
void SimulatedCluster::check_pace() {
    if (time_.now() / k_millisecond_ns != millisecond_) {
        millisecond_ = time_.now() / k_millisecond_ns;
        events_before_ = totals_.events;
    }
    if (totals_.events - events_before_ > k_most_at_once) fail("somebody's timer is due again and again");
}

void SimulatedCluster::check_progress() {
    const std::uint64_t committed = client_->machine().work().indirect_ledger().rounds_committed();
    const bool moved = std::exchange(committed_, committed) != committed;
    if (moved) check_light();
    if (moved || done() || client_->machine().complete() || !someone_can_work() || !calm())
        last_progress_ = time_.now();
    if (time_.now() - last_progress_ > k_longest_wait)
        fail(fmt::format("no round was committed for {:.0f} s though somebody could work; {} of {} are",
                         to_seconds(k_longest_wait), committed,
                         client_->machine().work().indirect_ledger().rounds()));
}

/// The indirect light so far is that of the rounds that are committed, and of no other state.
void SimulatedCluster::check_light() {
    const FrameWork& work = client_->machine().work();
    const Ledger& ledger = work.indirect_ledger();
    const std::uint32_t seed = client_->machine().state().settings.seed;
    for (std::uint32_t unit = 0; unit < ledger.plan().units; ++unit) {
        const UnitSnapshot committed = ledger.snapshot(unit);
        const PixelRect rect = work.rect_of(unit);
        PixelSum expected;  // Of the block's first pixel: a round has all of its pixels or none.
        for (std::uint32_t round = 0; round < committed.reached; ++round) {
            if (std::binary_search(committed.missing.begin(), committed.missing.end(), round)) continue;
            const SampleRange samples = samples_of_round(ledger.plan(), {unit, round});
            for (std::uint32_t s = samples.first; s < samples.first + samples.count; ++s)
                expected += light_of(seed, LightPart::indirect, rect.x, rect.y, s);
        }
        if (work.indirect().sum_at(rect.x, rect.y) != expected)
            return fail(fmt::format("the light of block {} is not that of its committed rounds", unit));
    }
}

void SimulatedCluster::check_picture(LightPart part, const FrameSums& sums, std::uint32_t spp) {
    const RenderSettings& settings = client_->machine().state().settings;
    for (int y = 0; y < settings.height; ++y)
        for (int x = 0; x < settings.width; ++x) {
            PixelSum expected;
            for (std::uint32_t s = 0; s < spp; ++s) expected += light_of(settings.seed, part, x, y, s);
            if (sums.sum_at(x, y) != expected)
                return fail(fmt::format("{} light of pixel ({}, {}) is not that of its samples",
                                        name_of(part), x, y));
        }
}

void SimulatedCluster::check_end() {
    if (!done()) {
        if (!someone_can_work()) return;  // Nobody was left, and the client was told to wait for somebody.
        return fail("the frame is not complete");
    }
    const ClientMachine& machine = client_->machine();
    check_picture(LightPart::indirect, machine.work().indirect(), machine.state().settings.spp);
    check_picture(LightPart::direct, machine.work().direct(), machine.state().settings.direct_spp);
    const Digest wanted = state_hash(machine.state());
    int alive = 0;
    for (const auto& server : servers_)
        if (server->runs() && !server->draining()) {
            ++alive;
            if (server->machine().working_on() != wanted)
                fail("a server does not hold the client's state at the end");
        }
    if (machine.progress().servers_ready != alive)
        fail(fmt::format("{} servers are alive at the end, and the client would give work to {}", alive,
                         machine.progress().servers_ready));
}

}  // namespace pathscope::testing
