#pragma once
/// The processes of a simulated cluster: the real state machines, and a world around each that is made of virtual time and
/// the cluster's network.

#include <fmt/format.h>

#include <string>
#include <utility>

#include "pathscope/session/admission.hpp"

#include "simulated_cluster.hpp"

namespace pathscope::testing {

/// A process: it runs, or is frozen, and has a timer.
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

/// The real machine of a client, in a process of the simulated world.
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

    void receive(const std::string& instance, Channel channel, Frames frames, const Sender& sender) {
        machine_.on_message(instance, std::move(frames), channel, time_.now(), sender);
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
    /// Results that were merged, of the servers of that name.
    [[nodiscard]] std::uint64_t rounds_of(std::string_view name) const {
        std::uint64_t rounds = 0;
        for (const ServerSummary& server : store_.servers())
            if (server.name == name) rounds += server.total(Counter::rounds_committed);
        return rounds;
    }

    [[nodiscard]] static ClientConfig config(const ClusterSettings& settings) {
        ClientConfig config;
        config.listens = true;
        config.min_servers = settings.servers > 0 ? settings.min_servers : 0;
        config.schedule = settings.schedule;
        config.detector = settings.detector;
        config.relaxed = settings.relaxed;
        config.block_size = settings.block;
        config.round_samples = settings.round_samples;
        config.lease_time = settings.lease_time;
        config.audit = {settings.audit, settings.seed};
        config.conduct.first_ban = 4 * k_second_ns;  // So that bans end while there is work.
        config.conduct.longest_ban = 20 * k_second_ns;
        return config;
    }

  private:
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

/// Whoever dials, with its line: a server or a relay.
class SimulatedCluster::Dialler : public Process {
  public:
    Dialler(SimulatedCluster& cluster, std::string name, int relay)
        : Process(cluster.time_), cluster_(cluster), name_(std::move(name)), relay_(relay) {}

    virtual void receive(const std::string& instance, Channel channel, Frames frames) = 0;
    virtual void connection_lost() = 0;
    [[nodiscard]] virtual const ServerMachine& machine() const = 0;

    void part(TimeNs until) { parted_until_ = std::max(parted_until_, until); }
    [[nodiscard]] TimeNs parted_until() const { return parted_until_; }
    [[nodiscard]] bool parted() const { return time_.now() < parted_until_; }
    [[nodiscard]] bool draining() const { return draining_; }
    [[nodiscard]] const std::string& name() const { return name_; }
    [[nodiscard]] int relay() const { return relay_; }  ///< That it dials, by number; none: the client.
    [[nodiscard]] bool reachable_as(const std::string& instance) const {
        return runs() && instance == instance_ && machine().linked();
    }
    [[nodiscard]] const std::string& instance() const { return instance_; }
    [[nodiscard]] Sender sender() const { return {"", "10.0.0.1"}; }
    [[nodiscard]] std::string conduct_name() const {
        return pathscope::conduct_name("", name_, sender().address);
    }

    Wire from_client[3], from_server[3];

  protected:
    void dial(ServerMachine& machine) {
        instance_ = cluster_.new_instance();
        const std::string instance = instance_;
        time_.at(time_.now() + 20 * k_millisecond_ns, [this, instance, &machine] {
            when_awake([this, instance, &machine] {
                if (instance == instance_) machine.on_linked(instance, time_.now());
            });
        });
    }

    SimulatedCluster& cluster_;
    std::string name_;
    std::string instance_;
    bool draining_ = false;

  private:
    int relay_;
    TimeNs parted_until_ = 0;
};

/// The same of a server.
class SimulatedCluster::Server : public Dialler, private ServerWorld {
  public:
    Server(SimulatedCluster& cluster, std::uint32_t pid, double samples_per_second, bool differs, int relay)
        : Dialler(cluster, fmt::format("server-{}", pid), relay),
          differs_(differs),
          machine_({name_, "0", differs ? bits_of_another() : own_bits(), 1, pid, "client"}, SceneCache({}),
                   *this),
          is_liar_(int(pid) <= cluster.settings_.liars),
          is_incapable_(!is_liar_ && int(pid) <= cluster.settings_.liars + cluster.settings_.incapable),
          renderer_(cluster.time_, samples_per_second, [this](RoundOutcome& outcome) {
              misrender(outcome);
              when_awake([this, outcome]() mutable { machine_.on_outcome(outcome, time_.now()); });
          }) {
        dial(machine_);
    }

    void receive(const std::string& instance, Channel channel, Frames frames) override {
        if (instance == instance_ && machine_.linked())
            machine_.on_message(std::move(frames), channel, time_.now());
    }
    void connection_lost() override { machine_.on_connection_lost(time_.now()); }
    /// SIGTERM.
    void drain() {
        if (std::exchange(draining_, true)) return;
        machine_.drain(time_.now());
    }
    [[nodiscard]] bool differs() const { return differs_; }
    void hang(TimeNs until) { renderer_.hang(until); }
    [[nodiscard]] const ServerMachine& machine() const override { return machine_; }

  private:
    /// One bit of the light, and nothing else: sizes and hashes are right.
    void misrender(RoundOutcome& outcome) {
        if (!outcome.result) return;
        if (is_incapable_) {
            ++cluster_.totals_.failures;
            outcome.result.reset();
            outcome.failure = "It has no scene to speak of.";
        } else if (is_liar_ && cluster_.chance(cluster_.settings_.lie)) {
            ++cluster_.totals_.lies;
            auto& sums = outcome.result->sums;
            sums[cluster_.rng_.next_u32() % sums.size()].g ^= std::int64_t{1}
                                                              << cluster_.rng_.next_u32() % 16;
        }
    }
    bool send(Channel channel, Frames&& frames) override {
        cluster_.to_client(*this, channel, std::move(frames));
        return true;
    }
    [[nodiscard]] static BitsIdentity bits_of_another() {
        BitsIdentity bits = own_bits();
        ++bits.golden[0];
        return bits;
    }
    void begin(RoundJob job) override { renderer_.begin(std::move(job)); }
    [[nodiscard]] std::uint64_t work_done() const override { return renderer_.work_done(); }
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
        if (was_linked && !machine_.linked()) dial(machine_);
    }
    [[nodiscard]] TimeNs next_timer() const override { return machine_.next_timer(time_.now()); }

    bool differs_;
    ServerMachine machine_;
    bool is_liar_, is_incapable_;
    SimulatedRenderer renderer_;
};

/// The same of a relay: it dials, and is dialled.
class SimulatedCluster::Relay : public Dialler, private RelayWorld {
  public:
    Relay(SimulatedCluster& cluster, int number, int relay)
        : Dialler(cluster, fmt::format("relay-{}", number), relay),
          number_(number),
          machine_({name_, "0", own_bits(), 1, std::uint32_t(number), "client"}, SceneCache({}),
                   Client::config(cluster.settings_), ++cluster.sessions_, store_, *this) {
        settle();
    }

    // Above.
    void receive(const std::string& instance, Channel channel, Frames frames) override {
        if (instance == instance_ && machine_.above().linked())
            machine_.above().on_message(std::move(frames), channel, time_.now());
    }
    void connection_lost() override { machine_.above().on_connection_lost(time_.now()); }
    void drain() {
        if (std::exchange(draining_, true)) return;
        machine_.drain(time_.now());
    }
    // Below.
    void receive(const std::string& instance, Channel channel, Frames frames, const Sender& sender) {
        machine_.on_message(instance, std::move(frames), channel, time_.now(), sender);
    }
    void server_lost() { machine_.on_connection_lost(time_.now()); }
    void pause(TimeNs duration) {
        freeze(time_.now() + duration);
        when_awake([this, duration] {
            if (duration > k_second_ns) machine_.on_own_pause(duration);
        });
    }

    [[nodiscard]] const ServerMachine& machine() const override { return machine_.above(); }
    [[nodiscard]] const RelayMachine& relay_machine() const { return machine_; }
    [[nodiscard]] const EventStore& store() const { return store_; }
    [[nodiscard]] int number() const { return number_; }

  private:
    bool send_up(Channel channel, Frames&& frames) override {
        cluster_.to_client(*this, channel, std::move(frames));
        return true;
    }
    bool send_down(Channel channel, const std::string& instance, Frames frames) override {
        return cluster_.to_server(channel, instance, std::move(frames));
    }
    void publish_down(Frames frames) override { cluster_.publish(number_, frames); }
    void check_scene(RenderState state, Manifest) override {
        time_.at(time_.now() + 5 * k_millisecond_ns, [this, state = std::move(state)] {
            when_awake([this, state] {
                CheckedScene checked{state, SceneDepot()};
                machine_.on_checked(checked, time_.now());
            });
        });
    }

    void on_timers() override {
        ServerMachine& above = machine_.above();
        const bool was_linked = above.linked();
        machine_.on_timers(time_.now());
        if (above.ended() || (draining_ && machine_.drained())) {
            machine_.say_goodbye(time_.now());
            return kill();
        }
        if (was_linked && !above.linked()) dialling_ = false;
        if (above.linked() || dialling_ || !machine_.wants_client(time_.now())) return;
        dialling_ = true;
        dial(above);
    }
    [[nodiscard]] TimeNs next_timer() const override { return machine_.next_timer(time_.now()); }

    int number_;
    EventStore store_;
    RelayMachine machine_;
    bool dialling_ = false;  ///< Since it was linked last.
};

inline void SimulatedCluster::Client::publish(Frames frames) { cluster_.publish(k_no_relay, frames); }

}  // namespace pathscope::testing
