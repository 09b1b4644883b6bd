#include <fmt/format.h>

#include <ctime>
#include <utility>
#include <vector>

#include "pathscope/cluster/ledger.hpp"
#include "pathscope/cluster/schedule.hpp"
#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

constexpr std::uint32_t k_rounds = 16;  ///< Of each unit.

/// A full-HD image in blocks of 32x32, for 1,000 servers with two leases each, answered in random order: what
/// the client does for every tile apart from sockets and pixels. One in a hundred leases is given back.
double tiles_per_second(ScheduleKind kind, EventStore* store) {
    constexpr std::uint32_t k_servers = 1000;
    Ledger ledger(store);
    ledger.new_epoch({Epoch{1}, 60 * 34, k_rounds, 1}, 0);
    Schedule schedule(kind, make_unit_order(UnitOrder::spiral, 60, 34));
    std::vector<ServerShare> servers;
    for (std::uint32_t i = 1; i <= k_servers; ++i) servers.push_back({ServerId{i}, double(i % 7 + 1)});
    schedule.set_servers(servers);

    HashRng rng(5);
    std::vector<Lease> out;
    const std::clock_t begin = std::clock();  // of the processor: other programs do not count
    TimeNs now = 0;
    const auto hand_out = [&](ServerId server) {
        if (const auto round = schedule.pick(ledger, server))
            out.push_back(*ledger.grant(server, *round, ++now, 6 * k_second_ns));
    };
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
    CHECK(ledger.complete());
    CHECK(ledger.rounds_committed() == 60 * 34 * k_rounds);
    return double(ledger.rounds_committed()) / seconds;
}

}  // namespace

TEST_CASE(
    "a thousand servers: tiles per second of one core through ledger and schedule (printed, not judged)") {
    for (const auto& [kind, name] : k_schedule_names) {
        EventStore counters(ProbeLevel::counters), full(ProbeLevel::full);
        const double bare = tiles_per_second(kind, nullptr);
        const double counted = tiles_per_second(kind, &counters);
        const double recorded = tiles_per_second(kind, &full);
        MESSAGE(fmt::format("{:>8}: {:.0f} tiles/s without a store, {:.0f} with counters, {:.0f} with events",
                            name, bare, counted, recorded));
        CHECK(counters.total(Counter::rounds_committed) == 60 * 34 * k_rounds);
    }
}
