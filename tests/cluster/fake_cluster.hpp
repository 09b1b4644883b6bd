#pragma once
/// A client and N servers in virtual time, over a network that delays, drops, doubles and reorders, with
/// servers that die, freeze, leave, join, refuse and lie. Everything follows from the seed.
///
/// The client is a miniature session: ledger, schedule, peers, credits, detectors and lease lengths work
/// together as in the real one. Beside it runs an oracle that knows nothing of the ledger: it keeps what was
/// merged, and what should be. After every event:
///   no round is merged twice, and none of another image than the present one;
///   the ledger's audit holds (conservation of leases, results, rounds; bounded records);
///   while work is left and somebody could do it, rounds are merged.
/// At the end every unit holds each of its rounds exactly once.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <queue>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "pathscope/cluster/failure_detector.hpp"
#include "pathscope/cluster/lease_policy.hpp"
#include "pathscope/cluster/ledger.hpp"
#include "pathscope/cluster/peer.hpp"
#include "pathscope/cluster/schedule.hpp"
#include "pathscope/math/random.hpp"

namespace pathscope::testing {

struct ClusterSettings {
    std::uint32_t seed = 0;
    std::uint32_t servers = 4;
    std::uint32_t most_servers = 8;  ///< Joins stop here.
    std::uint32_t units = 12;
    std::uint32_t samples = 20;
    std::uint32_t round_samples = 4;
    std::uint32_t most_rounds = 1;  ///< In one lease; how many is drawn each time.
    ScheduleKind schedule = ScheduleKind::pull;
    DetectorKind detector = DetectorKind::adaptive;
    float drop = 0;       ///< Of each message, its chance.
    float duplicate = 0;  ///< Likewise.
    float refuse = 0;     ///< Of each lease: the server gives it back.
    float lie = 0;        ///< Of each result: a forged one comes along.
    float careless = 0;   ///< Of each tick: the schedule proposes any round, open or not.
    double faults_per_second = 0;
    bool local_fallback =
        true;            ///< The client computes while no server is ready; else server process 0 is spared.
    int new_images = 0;  ///< How often the camera moves.
    int crashes = 0;     ///< How often the client dies and resumes from its checkpoint.
    TimeNs stop_at = 0;  ///< Above 0: open-ended work, stopped then.

    [[nodiscard]] static ClusterSettings from_seed(std::uint32_t seed);
    [[nodiscard]] std::string describe() const;
};

struct ClusterTotals {
    std::uint64_t events = 0;
    std::uint64_t audits = 0;
    TimeNs virtual_time = 0;
    std::uint64_t deaths = 0, false_deaths = 0;
    LedgerCounts ledger;
};

class FakeCluster {
  public:
    explicit FakeCluster(const ClusterSettings& settings);

    /// Runs until all is done. Returns what went wrong, or nothing.
    std::string run();

    [[nodiscard]] const ClusterTotals& totals() const { return totals_; }

  private:
    /// A result as it travels. `image` is what the server really computed it for: only the oracle looks.
    struct Result {
        ResultClaim claim;
        std::uint32_t image = 0;
        TimeNs took = 0;
    };

    /// A server process.
    struct Process {
        bool running = true;
        TimeNs frozen_until = 0;
        double samples_per_second = 1;
        ServerId id;  ///< As the client calls it; 0 until WELCOME.
        bool joining = false;
        bool busy = false;
        std::deque<std::pair<Lease, std::uint32_t>> queue;  ///< With the image they are for.
    };

    /// A server as the client sees it.
    struct Seat {
        Peer peer;
        Credits credits;
        FailureDetector detector;
        SpeedEstimate speed;
        std::size_t process;
    };

    // The world.
    void at(TimeNs when, std::function<void()> happens);
    void send(std::function<void()> arrives);
    double uniform() { return rng_.next_float(); }
    bool chance(double p) { return rng_.next_float() < p; }
    TimeNs soon(double most_seconds) { return from_seconds(uniform() * most_seconds) + 1; }
    void plan_faults();
    void strike();

    // Servers.
    void start_process();
    void beat(std::size_t p);
    void join(std::size_t p);
    void take(std::size_t p, const Lease& lease, std::uint32_t image);
    void compute(std::size_t p);
    void finish(std::size_t p, const Lease& lease, std::uint32_t image, TimeNs took);
    void leave(std::size_t p);

    // The client.
    void on_hello(std::size_t p);
    void on_beat(std::size_t p, ServerId id);
    void on_result(const Result& result);
    void on_refusal(ServerId id, LeaseId lease);
    void on_good_bye(ServerId id);
    void lose(ServerId id);
    void tick();
    void hand_out();
    void hand_out_to(ServerId id, Seat& seat);
    void grant_carelessly();
    void work_locally();
    void tell_schedule();
    void begin_image();
    void crash_and_resume();

    // The oracle.
    void merge(const Result& result);
    void fail(std::string why);
    void check_all();
    void check_progress();
    void check_end();
    [[nodiscard]] bool someone_can_work() const;

    ClusterSettings settings_;
    HashRng rng_;
    TimeNs now_ = 0;
    std::uint64_t order_ = 0;
    using Happening = std::pair<std::pair<TimeNs, std::uint64_t>, std::function<void()>>;
    struct Later {
        bool operator()(const Happening& a, const Happening& b) const { return a.first > b.first; }
    };
    std::priority_queue<Happening, std::vector<Happening>, Later> happenings_;

    std::deque<Process> processes_;

    EventStore store_;
    Ledger ledger_{&store_};
    Schedule schedule_;
    std::map<ServerId, Seat> seats_;
    std::uint32_t last_server_ = 0;
    std::uint32_t epoch_ = 0;
    bool local_busy_ = false;

    std::uint32_t image_ = 0;
    std::map<std::uint32_t, std::set<std::uint32_t>>
        merged_;  ///< First samples by unit, of the present image.
    TimeNs last_progress_ = 0;
    std::string failure_;
    ClusterTotals totals_;
};

}  // namespace pathscope::testing
