#pragma once
/// A client and N servers in virtual time: the real state machines, every message encoded and decoded, over a network that
/// delays, loses, doubles, damages and parts, with processes that die, freeze, drain, come and start again. Everything
/// follows from the seed. In a share of the worlds relays stand between some of the servers and the client, or another relay.
///
/// After every event:
///   the ledger's audit holds: each round is counted at most once, no lease is lost (cluster/ledger.hpp); so does each relay's;
///   each block's indirect light is that of its committed rounds, to the last bit;
///   while work is left and somebody could do it, rounds are committed;
///   what waits at a server is bounded by its credits;
///   no server of other bits is admitted, unless the client is relaxed; none is called stuck unless some renderer hung.
/// At the end, after a while without faults:
///   each pixel of both buffers is what the last state says, to the last bit: nothing lost, doubled or stale;
///   every server holds the client's state and works on it; those of other bits were refused, or marked the image.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "pathscope/session/client_machine.hpp"
#include "pathscope/session/relay_machine.hpp"
#include "pathscope/session/server_machine.hpp"

#include "simulated_renderer.hpp"
#include "virtual_time.hpp"

namespace pathscope::testing {

struct ClusterSettings {
    std::uint32_t seed = 0;
    int servers = 4;
    int most_servers = 8;  ///< Joins stop here.
    int relays = 0;        ///< Most servers are behind one, then.
    int width = 12, height = 8, block = 4;
    std::uint32_t spp = 6, direct_spp = 2, round_samples = 2;
    TimeNs lease_time = k_lease_time;
    ScheduleKind schedule = ScheduleKind::pull;
    DetectorKind detector = DetectorKind::adaptive;
    int min_servers = 0;
    double samples_per_second = 2000;  ///< Of the client; servers are slower or faster, by up to 8.
    // Of each message, its chance.
    float lose = 0, duplicate = 0, damage = 0;
    double faults_per_second = 0;
    float lie = 0;                     ///< Of a liar's results, the chance of one false bit.
    int liars = 0;                     ///< Of the servers, the first.
    int incapable = 0;                 ///< Of the servers, the next: they cannot do their work, and say so.
    double audit = 0;                  ///< Share of rounds that are rendered twice.
    int new_states = 0;                ///< How often somebody drags the camera.
    float differing = 0;               ///< The chance of a server to be one of other bits.
    bool relaxed = false;              ///< The client admits those too.
    int restarts = 0;                  ///< How often the client dies and is started again, from nothing.
    TimeNs calm_at = 8 * k_second_ns;  ///< No fault of any kind from then on.

    [[nodiscard]] static ClusterSettings from_seed(std::uint32_t seed);
    [[nodiscard]] std::string describe() const;
};

/// What happened, so that a test can see that everything did.
struct ClusterTotals {
    std::uint64_t events = 0, messages = 0;
    std::uint64_t lost = 0, doubled = 0, damaged = 0, parted = 0, unreachable = 0;
    std::uint64_t kills = 0, freezes = 0, partitions = 0, hangs = 0, drains = 0, joins = 0, pauses = 0,
                  restarts = 0, new_states = 0;
    std::uint64_t stuck = 0;                      ///< Servers seen to be so.
    std::uint64_t refused_bits = 0;               ///< Servers of other bits that were turned away.
    std::uint64_t marked_images = 0;              ///< For rounds of those that were admitted.
    std::uint64_t relay_faults = 0, relayed = 0;  ///< Of relays; rounds that came by them.
    std::uint64_t most_leases = 0;                ///< Of one server at once.
    std::uint64_t bad_messages = 0, deaths = 0, bans = 0;
    std::uint64_t lies = 0, audited = 0, unmasked = 0, undone = 0, failures = 0;
    LedgerCounts ledger;
    TimeNs virtual_time = 0;

    void add(const ClusterTotals& other);
};

class SimulatedCluster {
  public:
    explicit SimulatedCluster(const ClusterSettings& settings);
    ~SimulatedCluster();

    /// Runs until all is done. Returns what went wrong, or nothing.
    [[nodiscard]] std::string run();

    [[nodiscard]] const ClusterTotals& totals() const { return totals_; }

    /// For worlds made by hand: at that moment the renderers of all servers hang, for that long.
    void plan_hang(TimeNs at, TimeNs duration);

  private:
    class Client;
    class Dialler;
    class Server;
    class Relay;
    static constexpr int k_no_relay = -1;

    // The world.
    [[nodiscard]] double uniform() { return rng_.next_float(); }
    [[nodiscard]] bool chance(double p) { return uniform() < p; }
    [[nodiscard]] TimeNs soon(double most_seconds) { return from_seconds(uniform() * most_seconds) + 1; }
    [[nodiscard]] bool calm() const { return time_.now() >= settings_.calm_at; }
    [[nodiscard]] std::string new_instance();
    void start_client();
    void start_server();
    void start_relay(int number, int relay);
    void strike_relay();
    void restart_relay(Relay& relay);
    void hang_up(int relay);
    void tell_lost(Dialler& who);
    void publish(int relay, const Frames& frames);
    void plan_faults();
    void move_camera();
    void strike();

    /// One way of one connection: messages keep their order.
    struct Wire {
        TimeNs last_arrival = 0;
    };
    template <class Arrive>
    void transmit(Wire& wire, Dialler& dialler, Frames frames, Arrive arrive);
    [[nodiscard]] Frames damaged(Frames frames);
    void to_client(Dialler& dialler, Channel channel, Frames frames);
    [[nodiscard]] bool to_server(Channel channel, const std::string& instance, Frames frames);

    // The oracle.
    void fail(std::string why);
    void check_all();
    void check_pace();
    void check_progress();
    void check_end();
    void check_marks();
    void count_client();
    void check_dialler(const Dialler& dialler);
    [[nodiscard]] bool may_serve(const Server& server) const;
    [[nodiscard]] bool can_be_reached(const Dialler& dialler) const;
    [[nodiscard]] bool stands_for_somebody(int relay) const;
    void check_light();
    void check_accounts();
    void check_picture(LightPart part, const FrameSums& sums, std::uint32_t spp);
    [[nodiscard]] bool someone_can_work() const;
    [[nodiscard]] bool done() const;
    /// Whether each sum is to be that of its samples: at any time, or at the end at least.
    [[nodiscard]] bool always_honest() const { return settings_.liars == 0 || settings_.lie == 0; }
    /// What servers of other bits give cannot be audited.
    [[nodiscard]] bool honest_at_the_end() const {
        const bool all_audited = settings_.audit >= 1 && !(settings_.relaxed && settings_.differing > 0);
        return always_honest() || all_audited;
    }
    [[nodiscard]] TimeNs end_of_bans(TimeNs after) const;

    ClusterSettings settings_;
    ClusterTotals totals_;
    VirtualTime time_;
    HashRng rng_;
    std::uint32_t instances_ = 0, sessions_ = 0;
    std::vector<std::unique_ptr<Client>> clients_;  ///< Dead ones are kept: events may still name them.
    Client* client_ = nullptr;                      ///< The one that lives.
    std::vector<std::unique_ptr<Server>> servers_;
    std::vector<std::unique_ptr<Relay>> relays_;       ///< By number.
    std::vector<std::unique_ptr<Relay>> dead_relays_;  ///< Events may still name them.
    std::uint64_t committed_ = 0;                      ///< Of the client's present epoch, when it last rose.
    TimeNs last_progress_ = 0;
    TimeNs millisecond_ = 0;
    std::uint64_t events_before_ = 0;
    std::string failure_;
};

}  // namespace pathscope::testing
