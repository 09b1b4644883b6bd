/// detection: how long until a client knows that a server is dead?
///
///     time = moment at which the client has given the server up - moment of the signal that killed or froze it
///
/// Both moments are of one clock, as client and servers are on one machine; the signal comes from a thread of its own, at a
/// moment that nobody knows. A process that is killed closes its connections, and the end of one makes the client probe
/// all. One that is frozen closes nothing: its silence has to be told from that of a busy one. Servers are processes that
/// render; `idle` ones wait for work, `saturated` ones have more than their machine can do. Afterwards the largest herd is
/// watched for a while, saturated and in peace: nobody may be given up.

#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <thread>

#include "bench.hpp"
#include "measure.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/math/random.hpp"
#include "pathscope/session/child_process.hpp"
#include "served_job.hpp"
#include "terminal.hpp"

namespace pathscope::bench {
namespace {

using Json = nlohmann::ordered_json;

constexpr int k_width = 256, k_height = 256;
constexpr double k_endless = 1e12;  ///< Samples: no frame of it is ever finished.
constexpr TimeNs k_patience = 300 * k_second_ns;
constexpr TimeNs k_longest_step = 50 * k_millisecond_ns;
constexpr double k_settle_s = 2;    ///< From the last join to the next fault, so that beats have a rhythm.
constexpr int k_fixed_servers = 8;  ///< With the classic detector, which takes its time whatever the number.
constexpr double k_fixed_period_s = to_seconds(FixedDetectorParams{}.period);

enum class Load { idle, saturated };
enum class Fault { killed, frozen };

std::string_view word(Load load) { return load == Load::idle ? "idle" : "saturated"; }
std::string_view word(Fault fault) { return fault == Fault::killed ? "killed" : "frozen"; }

/// A client, and server processes that come and go.
class Herd {
  public:
    [[nodiscard]] static Result<std::unique_ptr<Herd>> start(const ClientJob& job, int servers, Load load,
                                                             DetectorKind detector) {
        ClientConfig config;
        config.detector = detector;
        config.threads = 1;
        config.listens = config.any_ports = true;
        config.min_servers = load == Load::idle ? servers + 1 : servers;  // One that never comes.
        auto herd = std::unique_ptr<Herd>(new Herd);
        auto client = ClientSession::create(config, job, herd->store_);
        if (!client) return client.error();
        herd->client_ = std::move(*client);
        for (int i = 0; i < servers; ++i)
            if (const auto joined = herd->add(); !joined) return joined.error();
        if (const auto ready = herd->wait_until_all_are_ready(); !ready) return ready.error();
        return herd;
    }

    [[nodiscard]] Result<void> add() {
        const auto port = [&](std::size_t i) {
            const std::string& endpoint = client_->endpoints()[i];
            return endpoint.substr(endpoint.rfind(':') + 1);
        };
        const std::string name = fmt::format("server-{}", ++started_);
        auto process = ChildProcess::start(program_folder() / "pathscope-server",
                                           {"--quiet", "--threads", "1", "--name", name, "--ports",
                                            port(0) + "," + port(1) + "," + port(2)});
        if (!process) return process.error();
        servers_.push_back({name, std::move(*process)});
        return {};
    }

    [[nodiscard]] Result<void> wait_until_all_are_ready() {
        return step_until("all servers were ready",
                          [&] { return client_->progress().servers_ready == int(servers_.size()); });
    }

    /// Strikes the oldest `count` servers, each `delay()` seconds after the last join. Returns how long each took to be
    /// given up, in milliseconds; they are gone then.
    [[nodiscard]] Result<std::vector<double>> strike(int count, Fault fault,
                                                     const std::function<double()>& delay) {
        struct Victim {
            Server server;
            std::atomic<TimeNs> struck{0};
            TimeNs given_up = 0;
            std::thread hand{};
        };
        std::deque<Victim> victims;
        for (int i = 0; i < count; ++i) {
            victims.emplace_back(std::move(servers_.front()));
            servers_.pop_front();
        }
        for (Victim& victim : victims)
            victim.hand = std::thread([&victim, fault, after = delay()] {
                std::this_thread::sleep_for(std::chrono::duration<double>(after));
                victim.struck.store(monotonic_now());
                victim.server.process.send_signal(fault == Fault::killed ? SIGKILL : SIGSTOP);
            });
        const auto done = step_until("the client had given up those that were struck", [&] {
            const TimeNs now = monotonic_now();
            bool all = true;
            for (Victim& victim : victims) {
                if (victim.given_up == 0 && died(victim.server.name)) victim.given_up = now;
                all = all && victim.given_up > 0;
            }
            return all;
        });
        std::vector<double> ms;
        for (Victim& victim : victims) {
            victim.hand.join();
            victim.server.process.send_signal(SIGKILL);
            const bool by_mistake = victim.given_up < victim.struck.load();
            if (!by_mistake) ms.push_back(1e3 * to_seconds(victim.given_up - victim.struck.load()));
        }
        struck_ += int(ms.size());
        if (!done) return done.error();
        return ms;
    }

    [[nodiscard]] Result<void> watch(double seconds) {
        const TimeNs end = monotonic_now() + from_seconds(seconds);
        return step_until(
            "the watch was over", [&] { return monotonic_now() >= end; }, from_seconds(seconds) + k_patience);
    }

    /// Servers that were given up though nothing had happened to them.
    [[nodiscard]] int false_deaths() const { return int(store_.total(Counter::died)) - struck_; }

  private:
    struct Server {
        std::string name;
        ChildProcess process;
    };

    Herd() = default;
    [[nodiscard]] bool died(const std::string& name) const {
        if (store_.total(Counter::died) == 0) return false;
        const std::vector<ServerSummary> all = store_.servers();
        return std::any_of(all.begin(), all.end(), [&](const ServerSummary& server) {
            return server.name == name && server.total(Counter::died) > 0;
        });
    }
    [[nodiscard]] Result<void> step_until(const std::string& what, const std::function<bool()>& done,
                                          TimeNs patience = k_patience) {
        for (const TimeNs limit = monotonic_now() + patience; !done(); client_->step(k_longest_step))
            if (monotonic_now() > limit) return failed("Waited too long until " + what + ".");
        return {};
    }

    EventStore store_;
    std::unique_ptr<ClientSession> client_;
    std::deque<Server> servers_;  ///< Oldest first.
    int started_ = 0, struck_ = 0;
};

struct Case {
    int servers;
    Load load;
    DetectorKind detector;
};

Json row_of(const Case& one, Fault fault, std::vector<double> ms, int false_deaths) {
    std::sort(ms.begin(), ms.end());
    const auto percentile = [&](double p) { return ms[std::size_t(p * double(ms.size() - 1) + 0.5)]; };
    return {{"servers", one.servers},
            {"load", std::string(word(one.load))},
            {"detector", std::string(name_of(one.detector))},
            {"fault", std::string(word(fault))},
            {"trials", ms.size()},
            {"ms_median", median(ms)},
            {"ms_p90", percentile(0.9)},
            {"ms_min", ms.front()},
            {"ms_max", ms.back()},
            {"false_deaths", false_deaths},
            {"ms", ms}};
}

/// One after the other, each replaced before the next.
Result<void> measure_adaptive(const Case& one, const ClientJob& job, int trials, Report& report) {
    auto herd = Herd::start(job, one.servers, one.load, one.detector);
    if (!herd) return herd.error();
    HashRng rng(1);
    for (const Fault fault : {Fault::killed, Fault::frozen}) {
        const int mistakes_before = (*herd)->false_deaths();
        std::vector<double> ms;
        for (int tries = 0; int(ms.size()) < trials && tries < 2 * trials; ++tries) {
            show_progress(fmt::format("{} servers, {}: {} {} of {}", one.servers, word(one.load), word(fault),
                                      ms.size() + 1, trials));
            const auto times = (*herd)->strike(1, fault, [&] { return k_settle_s + rng.next_float(); });
            if (!times) return times.error();
            ms.insert(ms.end(), times->begin(), times->end());
            if (const auto added = (*herd)->add(); !added) return added;
            if (const auto ready = (*herd)->wait_until_all_are_ready(); !ready) return ready;
        }
        if (ms.empty()) return failed("Every server was given up before it was struck.");
        report.rows.push_back(row_of(one, fault, ms, (*herd)->false_deaths() - mistakes_before));
    }
    return {};
}

/// The classic detector takes its six seconds however many there are: so several are struck within one of its periods.
Result<void> measure_fixed(const Case& one, const ClientJob& job, int trials, Report& report) {
    for (const Fault fault : {Fault::killed, Fault::frozen}) {
        auto herd = Herd::start(job, one.servers, one.load, one.detector);
        if (!herd) return herd.error();
        HashRng rng(1);
        std::vector<double> ms;
        while (int(ms.size()) < trials) {
            const int at_once = std::min(trials - int(ms.size()), one.servers);
            show_progress(fmt::format("{} servers, {}, fixed: {} {} of {}", one.servers, word(one.load),
                                      word(fault), ms.size() + 1, trials));
            const auto times =
                (*herd)->strike(at_once, fault, [&] { return k_fixed_period_s * rng.next_float(); });
            if (!times) return times.error();
            ms.insert(ms.end(), times->begin(), times->end());
            for (int i = 0; i < at_once; ++i)
                if (const auto added = (*herd)->add(); !added) return added;
            if (const auto ready = (*herd)->wait_until_all_are_ready(); !ready) return ready;
        }
        report.rows.push_back(row_of(one, fault, ms, (*herd)->false_deaths()));
    }
    return {};
}

Result<Json> watch_in_peace(int servers, const ClientJob& job, double seconds) {
    auto herd = Herd::start(job, servers, Load::saturated, DetectorKind::adaptive);
    if (!herd) return herd.error();
    show_progress(fmt::format("{} saturated servers in peace, for {:.0f} s", servers, seconds));
    if (const auto watched = (*herd)->watch(seconds); !watched) return watched.error();
    return Json{{"servers", servers}, {"seconds", seconds}, {"false_deaths", (*herd)->false_deaths()}};
}

void print(const Report& report) {
    TextTable table(
        {"servers", "load", "detector", "fault", "trials", "median ms", "p90", "min", "max", "false deaths"});
    const auto ms = [](const Json& row, const char* key) {
        return fmt::format("{:.1f}", row[key].get<double>());
    };
    for (const Json& row : report.rows)
        table.add({std::to_string(row["servers"].get<int>()), row["load"], row["detector"], row["fault"],
                   std::to_string(row["trials"].get<int>()), ms(row, "ms_median"), ms(row, "ms_p90"),
                   ms(row, "ms_min"), ms(row, "ms_max"), std::to_string(row["false_deaths"].get<int>())});
    table.print();
    const Json& watch = report.extra["watch"];
    fmt::print("{} saturated servers in peace for {:.0f} s: {} given up\n", watch["servers"].get<int>(),
               watch["seconds"].get<double>(), watch["false_deaths"].get<int>());
}

}  // namespace

Result<Report> bench_detection(const BenchOptions& options) {
    const Result<std::vector<SceneChoice>> scenes = list_scenes(options);
    if (!scenes) return scenes.error();
    Result<ClientJob> of_scene = scene_job(scenes->front());
    if (!of_scene) return of_scene.error();
    const ClientJob job = sized(std::move(*of_scene), k_width, k_height, k_endless);

    // What people are told of each join and loss is nothing for a benchmark's terminal.
    const ScopedLogSink quiet([](LogLevel, std::string_view) {});
    std::vector<int> counts = options.servers.empty() ? std::vector{1, 8, 32} : options.servers;
    std::sort(counts.begin(), counts.end());
    Report report;
    for (const int servers : counts)
        for (const Load load : {Load::idle, Load::saturated})
            if (const auto ok =
                    measure_adaptive({servers, load, DetectorKind::adaptive}, job, options.runs, report);
                !ok)
                return ok.error();
    for (const Load load : {Load::idle, Load::saturated})
        if (const auto ok =
                measure_fixed({k_fixed_servers, load, DetectorKind::fixed}, job, options.runs, report);
            !ok)
            return ok.error();
    Result<Json> watch = watch_in_peace(counts.back(), job, options.seconds.value_or(10));
    if (!watch) return watch.error();
    report.extra["watch"] = std::move(*watch);
    show_progress("");
    print(report);
    return report;
}

}  // namespace pathscope::bench
