/// ledger: how many tiles a second can one core of the client account for?
///
/// A full-HD image in blocks of 32x32, for 1,000 servers with two leases each, answered in random order: what the client
/// does for every tile apart from sockets and pixels. One lease in a hundred is given back.

#include <fmt/format.h>

#include <array>
#include <ctime>
#include <utility>

#include "bench.hpp"
#include "measure.hpp"
#include "pathscope/cluster/ledger.hpp"
#include "pathscope/cluster/schedule.hpp"
#include "pathscope/math/random.hpp"
#include "terminal.hpp"

namespace pathscope::bench {
namespace {

constexpr std::uint32_t k_servers = 1000;
constexpr std::uint32_t k_columns = 60, k_rows = 34;
constexpr std::uint32_t k_rounds = 16;  ///< Of each block.
constexpr std::uint64_t k_tiles = std::uint64_t(k_columns) * k_rows * k_rounds;
constexpr TimeNs k_lease = 6 * k_second_ns;

std::vector<ServerShare> make_servers() {
    std::vector<ServerShare> servers;
    for (std::uint32_t i = 1; i <= k_servers; ++i) servers.push_back({ServerId{i}, double(i % 7 + 1)});
    return servers;
}

/// Tiles per second of processor time. Requires: all were committed once, or there is nothing to boast of.
double tiles_per_second(ScheduleKind kind, EventStore* store) {
    Ledger ledger(store);
    ledger.new_epoch({Epoch{1}, k_columns * k_rows, k_rounds, 1}, 0);
    Schedule schedule(kind, make_unit_order(UnitOrder::spiral, k_columns, k_rows));
    const std::vector<ServerShare> servers = make_servers();
    schedule.set_servers(servers);

    HashRng rng(5);
    std::vector<Lease> out;
    TimeNs now = 0;
    const auto hand_out = [&](ServerId server) {
        if (const auto round = schedule.pick(ledger, server))
            out.push_back(*ledger.grant(server, *round, ++now, k_lease));
    };
    const std::clock_t begin = std::clock();
    for (const ServerShare& server : servers)
        for (int credit = 0; credit < 2; ++credit) hand_out(server.id);
    while (!out.empty()) {
        std::swap(out[rng.next_u32() % out.size()], out.back());
        const Lease lease = out.back();
        out.pop_back();
        if (rng.next_u32() % 100 == 0)
            ledger.release(lease.id, lease.server, now);
        else
            ledger.commit({lease.id, lease.epoch, lease.unit, lease.first, lease.count, lease.server}, now);
        ledger.expire(++now);
        hand_out(lease.server);
    }
    const double seconds = double(std::clock() - begin) / CLOCKS_PER_SEC;
    CHECK(ledger.complete() && ledger.rounds_committed() == k_tiles, ledger.rounds_committed());
    return double(k_tiles) / seconds;
}

/// Without an event store, as a lower bound of the cost, and with one at each level that records.
struct Recording {
    const char* name;
    std::optional<ProbeLevel> level;
};
constexpr std::array k_recordings{Recording{"none", std::nullopt},
                                  Recording{"counters", ProbeLevel::counters},
                                  Recording{"full", ProbeLevel::full}};

double measure(ScheduleKind kind, const Recording& recording) {
    if (!recording.level) return tiles_per_second(kind, nullptr);
    EventStore store(*recording.level);
    const double rate = tiles_per_second(kind, &store);
    CHECK(store.total(Counter::rounds_committed) == k_tiles);
    return rate;
}

}  // namespace

Result<Report> bench_ledger(const BenchOptions& options) {
    show_progress("ledger");
    std::vector<std::pair<ScheduleKind, Recording>> cases;
    for (const auto& schedule : k_schedule_names)
        for (const Recording& recording : k_recordings) cases.emplace_back(schedule.value, recording);
    std::vector<std::function<double()>> passes;
    for (const auto& c : cases) passes.push_back([&c] { return measure(c.first, c.second); });
    const auto rates = interleave(options.runs, passes);
    show_progress("");

    Report report;
    TextTable table({"schedule", "event store", "servers", "tiles/s"});
    for (std::size_t i = 0; i < cases.size(); ++i) {
        const std::string schedule(name_of(cases[i].first));
        const double rate = median(rates[i]);
        report.rows.push_back({{"servers", k_servers},
                               {"schedule", schedule},
                               {"event_store", cases[i].second.name},
                               {"tiles", k_tiles},
                               {"tiles_per_s", rate}});
        table.add({schedule, cases[i].second.name, std::to_string(k_servers), fmt::format("{:.0f}", rate)});
    }
    table.print();
    return report;
}

}  // namespace pathscope::bench
