#include "pathscope/probe/event_store.hpp"

#include <set>
#include <string>
#include <thread>
#include <vector>

#include "testing.hpp"

using namespace pathscope;

namespace {

Event note(TimeNs time, std::string_view text, ServerId process = {}) {
    return {time, 0, process, 0, NoteEvent{text}};
}

std::string text_of(const Event& event) { return std::string(std::get<NoteEvent>(event.body).text.view()); }

/// Entry i names enumerator i, no name is empty or used twice.
template <class E>
bool table_is_complete(E last) {
    std::set<std::string_view> names;
    int i = 0;
    for (const auto& [value, name] : enum_table(E{})) {
        if (static_cast<int>(value) != i++ || name.empty() || !names.insert(name).second) return false;
    }
    return i == static_cast<int>(last) + 1;
}

}  // namespace

TEST_CASE("tables of names are complete") {
    CHECK(table_is_complete(Counter::banned));
    CHECK(table_is_complete(Latency::tile));
    CHECK(table_is_complete(ProbeLevel::full));
    CHECK(table_is_complete(MessageWay::dropped));
    CHECK(table_is_complete(UnitChange::refused));
    CHECK(table_is_complete(UnitReason::undone));
    CHECK(table_is_complete(CheckOutcome::yes));
}

TEST_CASE("the statistics that programs promise are counters of these names") {
    for (const char* name : {"rounds", "rounds_committed", "duplicates_dropped", "stale_dropped",
                             "bad_messages", "leases_expired", "reallocated", "bytes_in", "bytes_out",
                             "nonfinite_dropped", "rays", "samples", "tiles", "died"})
        CHECK_MESSAGE(from_name<Counter>(name).has_value(), name);
}

TEST_CASE("a bounded text is cut between characters") {
    CHECK(BoundedText<4>("abc").view() == "abc");
    CHECK(BoundedText<4>("abcd").view() == "abcd");
    CHECK(BoundedText<4>("abcde").view() == "abcd");
    CHECK(BoundedText<4>("abc\xc3\xa9").view() == "abc");  // é takes two bytes
    CHECK(BoundedText<5>("abc\xc3\xa9").view() == "abc\xc3\xa9");
    CHECK(BoundedText<4>("\x80\x80\x80\x80\x80").view().empty());  // not UTF-8 at all
}

TEST_CASE("the ring keeps the newest events and counts the others") {
    EventStore store(ProbeLevel::full, {.events = 10, .servers = 4});
    for (int i = 1; i <= 25; ++i) store.record(note(i, std::to_string(i)));
    CHECK(store.recorded() == 25);
    CHECK(store.fallen_off() == 15);

    const std::vector<Event> kept = store.events_since(0, 100);
    REQUIRE(kept.size() == 10);
    for (int i = 0; i < 10; ++i) {
        CHECK(kept[std::size_t(i)].sequence == std::uint64_t(16 + i));
        CHECK(text_of(kept[std::size_t(i)]) == std::to_string(16 + i));
    }
    CHECK(store.events_since(20, 3).front().sequence == 21);
    CHECK(store.events_since(20, 3).size() == 3);
    CHECK(store.events_since(25, 3).empty());
    CHECK(store.events_since(99, 3).empty());
}

TEST_CASE("a visitor sees every event once, in order, piece by piece") {
    EventStore store(ProbeLevel::full);
    for (int i = 1; i <= 2000; ++i) store.record(note(i, "x"));
    std::uint64_t next = 1;
    bool in_order = true;
    const std::uint64_t last =
        store.visit_since(0, [&](const Event& event) { in_order &= event.sequence == next++; });
    CHECK(in_order);
    CHECK(next == 2001);
    CHECK(last == 2000);
    CHECK(store.visit_since(last, [](const Event&) { FAIL("nothing is new"); }) == 2000);
}

TEST_CASE("totals are exact however small the ring, and those of the servers add up to them") {
    EventStore store(ProbeLevel::full, {.events = 4, .servers = 8});
    std::uint64_t expected = 0;
    for (std::uint32_t i = 0; i < 1000; ++i) {
        store.count(Counter::samples, i, ServerId{i % 5});
        store.sample_counters(i);
        expected += i;
    }
    CHECK(store.total(Counter::samples) == expected);
    std::uint64_t of_servers = 0;
    for (const ServerSummary& server : store.servers()) of_servers += server.total(Counter::samples);
    CHECK(of_servers == expected);
    CHECK(store.server(ServerId{3})->total(Counter::samples) == 100 * (3 + 998));
    CHECK_FALSE(store.server(ServerId{7}).has_value());
}

TEST_CASE("what earlier runs counted is in the totals, and no server's") {
    EventStore store;
    store.count(Counter::rays, 5, ServerId{1});
    store.count_earlier({{Counter::rays, 100}, {Counter::samples, 7}});
    CHECK(store.total(Counter::rays) == 105);
    CHECK(store.total(Counter::samples) == 7);
    REQUIRE(store.servers().size() == 1);
    CHECK(store.servers()[0].total(Counter::rays) == 5);
}

TEST_CASE("servers beyond the limit count in the overall totals only") {
    EventStore store(ProbeLevel::counters, {.events = 4, .servers = 2});
    for (std::uint32_t id = 1; id <= 5; ++id) {
        store.count(Counter::tiles, 10, ServerId{id});
        store.add_latency(Latency::tile, 1000, ServerId{id});
    }
    CHECK(store.total(Counter::tiles) == 50);
    CHECK(store.servers().size() == 2);
}

TEST_CASE("levels: off keeps nothing, counters no events, full all") {
    for (const ProbeLevel level : {ProbeLevel::off, ProbeLevel::counters, ProbeLevel::full}) {
        EventStore store(level);
        store.count(Counter::rays, 7);
        store.add_latency(Latency::heartbeat, k_millisecond_ns, ServerId{1});
        store.record(note(1, "x"));
        store.sample_counters(2);
        CHECK(store.total(Counter::rays) == (level == ProbeLevel::off ? 0 : 7));
        CHECK(store.servers().size() == (level == ProbeLevel::off ? 0 : 2));
        CHECK(store.recorded() == (level == ProbeLevel::full ? 2 : 0));
    }
}

TEST_CASE("counters are sampled when they rose, with their totals") {
    EventStore store(ProbeLevel::full);
    store.count(Counter::tiles, 2);
    store.sample_counters(10);
    store.sample_counters(20);
    store.count(Counter::tiles, 3);
    store.sample_counters(30);
    const std::vector<Event> events = store.events_since(0, 10);
    REQUIRE(events.size() == 2);
    CHECK(events[0].time == 10);
    CHECK(std::get<CounterEvent>(events[0].body).total == 2);
    CHECK(events[1].time == 30);
    CHECK(std::get<CounterEvent>(events[1].body).total == 5);
}

TEST_CASE("latencies are summed up per server and kind") {
    EventStore store;
    for (int i = 1; i <= 100; ++i) store.add_latency(Latency::heartbeat, i * k_millisecond_ns, ServerId{1});
    store.add_latency(Latency::tile, -5, ServerId{1});
    store.name_server(ServerId{1}, std::string(100, 'n'));
    const ServerSummary summary = *store.server(ServerId{1});
    const LatencySummary& beats = summary.latency(Latency::heartbeat);
    CHECK(beats.count == 100);
    CHECK(beats.mean_ms == doctest::Approx(50.5));
    CHECK(beats.p50_ms == doctest::Approx(50).epsilon(LatencyHistogram::k_relative_error));
    CHECK(beats.p95_ms == doctest::Approx(95).epsilon(LatencyHistogram::k_relative_error));
    CHECK(beats.largest_ms == 100);
    CHECK(summary.latency(Latency::tile).largest_ms == 0);
    CHECK(summary.name == std::string(64, 'n'));
}

TEST_CASE("many producers and a reader: nothing is lost, each producer's order is kept") {
    constexpr int k_producers = 4, k_each = 5000;
    EventStore store(ProbeLevel::full, {.events = k_producers * k_each, .servers = 8});
    std::vector<std::thread> producers;
    for (int p = 0; p < k_producers; ++p)
        producers.emplace_back([&, p] {
            const ServerId self{std::uint32_t(p)};
            for (int i = 0; i < k_each; ++i) {
                store.count_all({{Counter::rays, 3}, {Counter::samples, 1}}, self);
                store.record({i, 0, self, 0, NoteEvent{}});
            }
        });

    std::vector<TimeNs> next_time(k_producers, 0);
    bool in_order = true;
    std::uint64_t cursor = 0, seen = 0;
    const auto read = [&] {
        cursor = store.visit_since(cursor, [&](const Event& event) {
            in_order &= event.sequence == ++seen && event.time == next_time[event.process.value]++;
        });
    };
    while (seen < k_producers * k_each / 2) read();
    for (std::thread& producer : producers) producer.join();
    read();

    CHECK(in_order);
    CHECK(seen == k_producers * k_each);
    CHECK(store.total(Counter::rays) == 3 * k_producers * k_each);
    for (const ServerSummary& server : store.servers()) CHECK(server.total(Counter::samples) == k_each);
}
