#include "pathscope/probe/trace_export.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "pathscope/core/files.hpp"

#include "testing.hpp"

using namespace pathscope;
using Json = nlohmann::json;

namespace {

constexpr TimeNs k_start = 500 * k_second_ns;  // traces begin at their first event, not at the clock's zero

void record_unit(EventStore& store, TimeNs ms, std::uint64_t lease, std::uint32_t server, UnitChange change,
                 UnitReason reason) {
    store.record({k_start + ms * k_millisecond_ns,
                  0,
                  {},
                  0,
                  UnitEvent{Epoch{1}, 7, 0, 4, LeaseId{lease}, ServerId{server}, {}, change, reason}});
}

std::vector<Json> events_of(const EventStore& store) {
    const Json trace = Json::parse(trace_json(store));
    return trace.at("traceEvents").get<std::vector<Json>>();
}

std::vector<Json> with_phase(const std::vector<Json>& events, const std::string& phase) {
    std::vector<Json> found;
    for (const Json& event : events)
        if (event.at("ph") == phase) found.push_back(event);
    return found;
}

/// The bars of a server's leases, by lease.
std::map<int, Json> lease_bars(const std::vector<Json>& events, int server) {
    std::map<int, Json> bars;
    for (const Json& event : with_phase(events, "X"))
        if (event.at("pid") == server + 1) bars[event.at("args").at("lease").get<int>()] = event;
    return bars;
}

}  // namespace

TEST_CASE("an empty store is a valid trace") { CHECK(events_of(EventStore(ProbeLevel::full)).empty()); }

TEST_CASE("a lease is a bar from grant to commit, with an arrow through it") {
    EventStore store(ProbeLevel::full);
    store.name_server(ServerId{3}, "bee");
    record_unit(store, 0, 1, 3, UnitChange::granted, UnitReason::fresh);
    record_unit(store, 12, 1, 3, UnitChange::committed, UnitReason::result);
    const std::vector<Json> events = events_of(store);

    const Json bar = lease_bars(events, 3).at(1);
    CHECK(bar.at("ts") == 0.0);
    CHECK(bar.at("dur") == 12000.0);
    CHECK(bar.at("name") == "unit 7 [0, 4)");
    CHECK(bar.at("args").at("ended") == "result");

    // The arrow: from the client at the grant, over the server, to the client at the commit.
    std::vector<std::pair<double, int>> places;
    for (const char* phase : {"s", "t", "f"})
        for (const Json& end : with_phase(events, phase)) {
            CHECK(end.at("id") == 1);
            places.emplace_back(end.at("ts").get<double>(), end.at("pid").get<int>());
        }
    CHECK(places == std::vector<std::pair<double, int>>{{0.0, 1}, {0.0, 4}, {12000.0, 1}});

    const std::vector<Json> names = with_phase(events, "M");
    CHECK(std::any_of(names.begin(), names.end(), [](const Json& name) {
        return name.at("name") == "process_name" && name.at("pid") == 4 &&
               name.at("args").at("name") == "server 3 bee";
    }));
}

TEST_CASE("leases that end otherwise say how, and one that never ended reaches to the last event") {
    EventStore store(ProbeLevel::full);
    record_unit(store, 0, 1, 1, UnitChange::granted, UnitReason::fresh);
    record_unit(store, 1, 2, 1, UnitChange::granted, UnitReason::fresh);
    record_unit(store, 6, 1, 1, UnitChange::reopened, UnitReason::lease_expired);
    record_unit(store, 9, 1, 1, UnitChange::committed, UnitReason::late_result);
    record_unit(store, 10, 3, 1, UnitChange::committed, UnitReason::result);  // its grant fell off the ring
    record_unit(store, 11, 1, 1, UnitChange::refused, UnitReason::duplicate);
    const std::vector<Json> events = events_of(store);
    const std::map<int, Json> bars = lease_bars(events, 1);
    REQUIRE(bars.size() == 2);
    CHECK(bars.at(1).at("args").at("ended") == "lease_expired");
    CHECK(bars.at(1).at("dur") == 6000.0);
    CHECK(bars.at(2).at("args").at("ended") == "open");
    CHECK(bars.at(2).at("dur") == 10000.0);

    // Every arrow that begins ends exactly once.
    std::multiset<int> begun, ended;
    for (const Json& end : with_phase(events, "s")) begun.insert(end.at("id").get<int>());
    for (const Json& end : with_phase(events, "f")) ended.insert(end.at("id").get<int>());
    CHECK(begun == ended);
    CHECK(begun == std::multiset<int>{1, 2});
}

TEST_CASE("bars of one line never overlap, however many leases a server holds") {
    EventStore store(ProbeLevel::full);
    for (std::uint64_t i = 1; i <= 40; ++i) {
        record_unit(store, TimeNs(i), i, 1 + i % 2, UnitChange::granted, UnitReason::fresh);
        if (i > 5)
            record_unit(store, TimeNs(i), i - 5, 1 + (i - 5) % 2, UnitChange::committed, UnitReason::result);
    }
    for (std::uint64_t i = 41; i <= 44; ++i)  // four at once: marks of no width rather than overlapping ones
        record_unit(store, 50, i, 1, UnitChange::granted, UnitReason::fresh);

    std::map<std::pair<int, int>, std::vector<std::pair<double, double>>> lines;
    for (const Json& bar : with_phase(events_of(store), "X"))
        lines[{bar.at("pid").get<int>(), bar.at("tid").get<int>()}].emplace_back(
            bar.at("ts").get<double>(), bar.at("ts").get<double>() + bar.at("dur").get<double>());
    CHECK(lines.size() >= 6);  // grants, commits, at least two lines for each server
    for (auto& [line, bars] : lines) {
        std::sort(bars.begin(), bars.end());
        for (std::size_t i = 1; i < bars.size(); ++i) CHECK(bars[i].first >= bars[i - 1].second - 1e-6);
    }
}

TEST_CASE("every kind of event is drawn, every line has a name, and what peers sent cannot break the JSON") {
    EventStore store(ProbeLevel::full);
    const TimeNs t = k_start;
    store.record({t, 0, ServerId{2}, 5, SpanEvent{"render", 3 * k_millisecond_ns, {}}});
    store.count(Counter::rays, 42);
    store.sample_counters(t + 1000);
    store.record({t,
                  0,
                  {},
                  0,
                  MessageEvent{MessageWay::dropped, "TI\"LE\n", "frames", ServerId{2}, 99, "\xff\xfe\\ "}});
    store.record({t, 0, {}, 0, StateEvent{"peer", ServerId{2}, "READY", "SUSPECT", "silent"}});
    store.record({t, 0, {}, 0, CheckEvent{"servers() == 2", CheckOutcome::yes}});
    store.record({t, 0, {}, 0, CommandEvent{"server.kill 1", "menu"}});
    store.record({t, 0, {}, 0, NoteEvent{"done"}});
    const std::vector<Json> events = events_of(store);

    CHECK(with_phase(events, "X").at(0).at("dur") == 3000.0);
    CHECK(with_phase(events, "C").at(0).at("args").at("total") == 42);
    CHECK(with_phase(events, "C").at(0).at("ts") == 1.0);
    CHECK(with_phase(events, "i").size() == 5);
    std::set<std::pair<int, int>> used, named;
    for (const Json& event : events) {
        const std::pair<int, int> line{event.at("pid").get<int>(), event.at("tid").get<int>()};
        if (event.at("ph") != "M") used.insert(line);
        if (event.at("name") == "thread_name") named.insert(line);
    }
    CHECK(used == named);
}

TEST_CASE("a span that served a lease is a joint of its arrow") {
    EventStore store(ProbeLevel::full);
    record_unit(store, 0, 1, 1, UnitChange::granted, UnitReason::fresh);
    store.record({k_start + 2 * k_millisecond_ns, 0, ServerId{1}, 0,
                  SpanEvent{"render", k_millisecond_ns, LeaseId{1}}});
    record_unit(store, 5, 1, 1, UnitChange::committed, UnitReason::result);
    const std::vector<Json> joints = with_phase(events_of(store), "t");
    REQUIRE(joints.size() == 2);
    CHECK(std::any_of(joints.begin(), joints.end(),
                      [](const Json& joint) { return joint.at("ts") == 2000.0; }));
}

TEST_CASE("a trace is written to a file, or the error names it") {
    const testing::TemporaryFolder temporary;
    EventStore store(ProbeLevel::full);
    record_unit(store, 0, 1, 1, UnitChange::granted, UnitReason::fresh);
    const auto path = temporary.path() / "trace.json";
    REQUIRE(bool(write_trace(store, path)));
    CHECK(Json::parse(*read_file(path)).at("traceEvents").size() > 3);
    CHECK(write_trace(store, temporary.path() / "no" / "trace.json").error().message.find("trace.json") !=
          std::string::npos);
}
