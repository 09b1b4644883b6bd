#include "pathscope/cluster/schedule.hpp"

#include <algorithm>
#include <map>
#include <queue>
#include <set>
#include <vector>

#include "testing.hpp"

using namespace pathscope;

namespace {

constexpr ServerId k_a{1}, k_b{2}, k_c{3};
constexpr TimeNs k_lease = 1000 * k_second_ns;

Ledger ledger_of(std::uint32_t units, std::uint32_t rounds, std::uint32_t epoch = 1) {
    Ledger ledger;
    ledger.new_epoch({Epoch{epoch}, units, rounds, 1}, 0);
    return ledger;
}

Schedule schedule_of(ScheduleKind kind, std::uint32_t units, std::vector<ServerShare> servers) {
    Schedule schedule(kind, make_unit_order(UnitOrder::scanline, units, 1));
    schedule.set_servers(std::move(servers));
    return schedule;
}

void commit(Ledger& ledger, const Lease& lease) {
    REQUIRE(ledger.commit({lease.id, lease.epoch, lease.unit, lease.first, lease.count, lease.server}, 0)
                .verdict == Verdict::accepted);
}

/// How many units each server owns.
std::map<ServerId, int> owned(const Schedule& schedule) {
    std::map<ServerId, int> units;
    for (const ServerId owner : schedule.owners()) ++units[owner];
    return units;
}

/// Virtual time until all is done, if server i needs seconds[i] per round and always has one lease.
double makespan(ScheduleKind kind, std::uint32_t units, std::uint32_t rounds,
                const std::vector<double>& seconds) {
    Ledger ledger = ledger_of(units, rounds);
    std::vector<ServerShare> servers;
    for (std::size_t i = 0; i < seconds.size(); ++i)
        servers.push_back({ServerId{std::uint32_t(i + 1)}, 1 / seconds[i]});
    Schedule schedule = schedule_of(kind, units, servers);
    using Done = std::pair<double, Lease>;
    const auto later = [](const Done& a, const Done& b) { return a.first > b.first; };
    std::priority_queue<Done, std::vector<Done>, decltype(later)> running(later);
    const auto start = [&](ServerId server, double now) {
        if (const auto round = schedule.pick(ledger, server))
            running.emplace(now + seconds[server.value - 1], *ledger.grant(server, *round, 0, k_lease));
    };
    for (const ServerShare& server : servers) start(server.id, 0);
    double now = 0;
    while (!running.empty()) {
        const Done done = running.top();
        running.pop();
        now = done.first;
        commit(ledger, done.second);
        start(done.second.server, now);
    }
    REQUIRE(ledger.complete());
    return now;
}

}  // namespace

TEST_CASE("schedules and orders have names") {
    CHECK(from_name<ScheduleKind>("static") == ScheduleKind::static_shares);
    CHECK(from_name<ScheduleKind>("weighted") == ScheduleKind::weighted_shares);
    CHECK(from_name<ScheduleKind>("pull") == ScheduleKind::pull);
    CHECK(joined_names<UnitOrder>() == "scanline|spiral");
}

TEST_CASE("orders name each unit once; the spiral goes round from the centre") {
    for (const auto& [columns, rows] : {std::pair{1u, 1u}, {5u, 3u}, {4u, 4u}, {1u, 7u}, {40u, 23u}})
        for (const UnitOrder order : {UnitOrder::scanline, UnitOrder::spiral}) {
            const std::vector<std::uint32_t> units = make_unit_order(order, columns, rows);
            CHECK(std::set(units.begin(), units.end()).size() == columns * rows);
            CHECK(units.size() == columns * rows);
        }
    CHECK(make_unit_order(UnitOrder::scanline, 3, 2) == std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5});
    CHECK(make_unit_order(UnitOrder::spiral, 3, 3) == std::vector<std::uint32_t>{4, 0, 1, 2, 5, 8, 7, 6, 3});
    CHECK(make_unit_order(UnitOrder::spiral, 0, 3).empty());
}

TEST_CASE("every unit gets its first round before any gets its second") {
    for (const ScheduleKind kind :
         {ScheduleKind::static_shares, ScheduleKind::weighted_shares, ScheduleKind::pull}) {
        Ledger ledger = ledger_of(6, 3);
        Schedule schedule = schedule_of(kind, 6, {{k_a, 1}});
        std::vector<RoundKey> order;
        while (const auto round = schedule.pick(ledger, k_a)) {
            CHECK(schedule.pick(ledger, k_a) == round);  // proposing changes nothing
            order.push_back(*round);
            commit(ledger, *ledger.grant(k_a, *round, 0, k_lease));
        }
        REQUIRE(order.size() == 18);
        for (std::uint32_t i = 0; i < 18; ++i) CHECK(order[i] == RoundKey{i % 6, i / 6});
        CHECK(ledger.complete());
    }
}

TEST_CASE("reopened rounds come first") {
    for (const ScheduleKind kind :
         {ScheduleKind::static_shares, ScheduleKind::weighted_shares, ScheduleKind::pull}) {
        Ledger ledger = ledger_of(6, 3);
        Schedule schedule = schedule_of(kind, 6, {{k_a, 1}});
        std::vector<Lease> leases;
        for (int i = 0; i < 4; ++i)
            leases.push_back(*ledger.grant(k_a, *schedule.pick(ledger, k_a), 0, k_lease));
        ledger.release(leases[2].id, k_a, 0);
        ledger.release(leases[0].id, k_a, 0);
        CHECK(*schedule.pick(ledger, k_a) == RoundKey{2, 0});
        ledger.grant(k_a, {2, 0}, 0, k_lease);
        CHECK(*schedule.pick(ledger, k_a) == RoundKey{0, 0});
        ledger.grant(k_a, {0, 0}, 0, k_lease);
        CHECK(*schedule.pick(ledger, k_a) == RoundKey{4, 0});
    }
}

TEST_CASE("static: unit i to server i mod N; a death moves only the units of the dead; a join deals anew") {
    Schedule schedule = schedule_of(ScheduleKind::static_shares, 12, {{k_c, 1}, {k_a, 1}, {k_b, 1}});
    for (std::uint32_t unit = 0; unit < 12; ++unit) CHECK(schedule.owners()[unit] == ServerId{1 + unit % 3});

    const std::vector<ServerId> before = schedule.owners();
    schedule.set_servers({{k_a, 1}, {k_c, 1}});
    for (std::uint32_t unit = 0; unit < 12; ++unit)
        if (before[unit] != k_b) CHECK(schedule.owners()[unit] == before[unit]);
    CHECK(owned(schedule) == std::map<ServerId, int>{{k_a, 6}, {k_c, 6}});

    schedule.set_servers({{k_c, 1}});
    CHECK(owned(schedule) == std::map<ServerId, int>{{k_c, 12}});
    schedule.set_servers({{k_c, 1}, {ServerId{4}, 1}});
    CHECK(owned(schedule) == std::map<ServerId, int>{{k_c, 6}, {ServerId{4}, 6}});
    schedule.set_servers({});
    CHECK(schedule.owners().empty());
    Ledger ledger = ledger_of(12, 1);
    CHECK_FALSE(schedule.pick(ledger, k_c).has_value());
}

TEST_CASE("static: a server gets its own units only, and those of the dead once they are its own") {
    Ledger ledger = ledger_of(4, 1);
    Schedule schedule = schedule_of(ScheduleKind::static_shares, 4, {{k_a, 1}, {k_b, 1}});
    const Lease lost = *ledger.grant(k_b, *schedule.pick(ledger, k_b), 0, k_lease);
    CHECK(lost.unit == 1);
    for (const std::uint32_t unit : {0u, 2u}) {
        CHECK(schedule.pick(ledger, k_a)->unit == unit);
        ledger.grant(k_a, {unit, 0}, 0, k_lease);
    }
    ledger.revoke(k_b, 0);
    CHECK_FALSE(schedule.pick(ledger, k_a).has_value());  // reopened, but still of the dead one
    schedule.set_servers({{k_a, 1}});
    CHECK(schedule.pick(ledger, k_a)->unit == 1);
    ledger.grant(k_a, {1, 0}, 0, k_lease);
    CHECK(schedule.pick(ledger, k_a)->unit == 3);
    CHECK_FALSE(schedule.pick(ledger, k_b).has_value());
}

TEST_CASE("weighted: units in proportion to speed; small changes do not move them") {
    Schedule schedule = schedule_of(ScheduleKind::weighted_shares, 700, {{k_a, 100}, {k_b, 200}, {k_c, 400}});
    CHECK(owned(schedule) == std::map<ServerId, int>{{k_a, 100}, {k_b, 200}, {k_c, 400}});
    const std::vector<ServerId> before = schedule.owners();
    schedule.set_servers({{k_a, 110}, {k_b, 190}, {k_c, 400}});
    CHECK(schedule.owners() == before);
    schedule.set_servers({{k_a, 300}, {k_b, 200}, {k_c, 200}});
    CHECK(owned(schedule) == std::map<ServerId, int>{{k_a, 300}, {k_b, 200}, {k_c, 200}});
    schedule.set_servers({{k_a, 300}, {k_b, 0}});  // not measured: taken for average
    CHECK(owned(schedule) == std::map<ServerId, int>{{k_a, 350}, {k_b, 350}});
}

TEST_CASE("a new epoch starts from the front") {
    Ledger ledger = ledger_of(3, 2);
    Schedule schedule = schedule_of(ScheduleKind::pull, 3, {{k_a, 1}});
    for (int i = 0; i < 6; ++i) ledger.grant(k_a, *schedule.pick(ledger, k_a), 0, k_lease);
    CHECK_FALSE(schedule.pick(ledger, k_a).has_value());
    ledger.new_epoch({Epoch{2}, 3, 2, 1}, 0);
    CHECK(*schedule.pick(ledger, k_a) == RoundKey{0, 0});
    ledger.stop();
    CHECK_FALSE(schedule.pick(ledger, k_a).has_value());
}

TEST_CASE("after a checkpoint the units that are behind come first") {
    Ledger ledger = ledger_of(3, 5);
    REQUIRE(bool(ledger.restore(0, {4, {}})));
    REQUIRE(bool(ledger.restore(2, {2, {1}})));
    Schedule schedule = schedule_of(ScheduleKind::pull, 3, {{k_a, 1}});
    std::vector<RoundKey> order;
    while (const auto round = schedule.pick(ledger, k_a)) {
        order.push_back(*round);
        ledger.grant(k_a, *round, 0, k_lease);
    }
    CHECK(order == std::vector<RoundKey>{
                       {2, 1}, {1, 0}, {1, 1}, {1, 2}, {2, 2}, {1, 3}, {2, 3}, {0, 4}, {1, 4}, {2, 4}});
}

TEST_CASE("makespans are what arithmetic says: static waits for the slowest, the others do not") {
    // Four servers, one at a quarter of the speed: 96 units x 4 rounds of a second each, ideal 384 / 3.25 =
    // 118 s.
    const std::vector<double> seconds{1, 1, 1, 4};
    CHECK(makespan(ScheduleKind::static_shares, 96, 4, seconds) == 384 / 4 * 4);
    CHECK(makespan(ScheduleKind::pull, 96, 4, seconds) <= 384 / 3.25 + 4);
    CHECK(makespan(ScheduleKind::weighted_shares, 96, 4, seconds) <= 384 / 3.25 + 4 * 4);
    CHECK(makespan(ScheduleKind::static_shares, 96, 4, {1, 1, 1, 1}) == 96);
}

TEST_CASE("an idle server copies the oldest lease, once that is old enough") {
    Ledger ledger = ledger_of(2, 1);
    ledger.grant(k_a, {0, 0}, 0, k_lease);
    ledger.grant(k_b, {1, 0}, k_second_ns, k_lease);
    const auto own = [](const Lease& lease) { return std::optional(TimeNs(lease.count) * 2 * k_second_ns); };
    const auto unknown = [](const Lease&) { return std::optional<TimeNs>(); };
    CHECK_FALSE(pick_straggler(ledger, k_c, 3 * k_second_ns, own).has_value());
    CHECK(pick_straggler(ledger, k_c, 3 * k_second_ns + 1, own)->unit == 0);
    CHECK_FALSE(pick_straggler(ledger, k_c, 3 * k_second_ns + 1, unknown).has_value());
    ledger.grant_copy(k_c, {0, 0}, 0, k_lease);
    CHECK_FALSE(pick_straggler(ledger, k_c, 4 * k_second_ns, own).has_value());
    CHECK(pick_straggler(ledger, k_c, 5 * k_second_ns, own)->unit == 1);
    CHECK_FALSE(pick_straggler(ledger, k_b, 500 * k_second_ns, own)
                    .has_value());  // its own is no straggler to itself
}

TEST_CASE("every kind of schedule finds the rounds that a staged plan opens later") {
    for (const auto& [kind, name] : k_schedule_names) {
        CAPTURE(name);
        LedgerPlan plan{Epoch{1}, 6, 8, 1};
        plan.staged = true;
        Ledger ledger;
        ledger.new_epoch(plan, 0);
        Schedule schedule = schedule_of(kind, 6, {{k_a, 1}, {k_b, 2}});
        CHECK(!schedule.pick(ledger, k_a));
        for (const std::uint32_t stage : {1u, 3u, 8u}) {
            for (const std::uint32_t unit : {0u, 2u, 3u, 5u}) ledger.open(unit, stage);
            int picked = 0;
            for (const ServerId server : {k_a, k_b})
                while (const auto round = schedule.pick(ledger, server)) {
                    CHECK(round->index < stage);
                    commit(ledger, ledger.grant(server, *round, 0, k_lease).value());
                    ++picked;
                }
            CHECK(picked == 4 * int(stage == 1 ? 1 : stage == 3 ? 2 : 5));
            CHECK(ledger.complete());
        }
    }
}
