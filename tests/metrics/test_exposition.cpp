// What the page of metrics says, against numbers on paper.

#include "pathscope/metrics/exposition.hpp"

#include <sstream>

#include "testing.hpp"

using namespace pathscope;

namespace {

/// A server for each id, each with one heartbeat of 2 ms.
EventStore& fill(EventStore& store, std::uint32_t servers) {
    for (std::uint32_t i = 1; i <= servers; ++i) {
        store.name_server(ServerId{i}, "far");
        store.add_latency(Latency::heartbeat, 2 * k_millisecond_ns, ServerId{i});
    }
    return store;
}

bool has_line(const std::string& text, const std::string& line) {
    return ("\n" + text).find("\n" + line + "\n") != std::string::npos;
}

std::size_t count_of(const std::string& text, const std::string& word) {
    std::size_t count = 0;
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++count;
    return count;
}

}  // namespace

TEST_CASE("queue seconds are work divided by speed; 0 with nothing left, nothing while no speed is known") {
    ClusterFigures figures;
    CHECK(figures.queue_seconds() == 0);
    figures.samples_left = 3000;
    CHECK(!figures.queue_seconds());
    figures.samples_per_second = 200;
    CHECK(figures.queue_seconds() == 15);
}

TEST_CASE("rates are those of the last ten seconds") {
    RateWindow window;
    CounterTotals totals{};
    CHECK(window.rates().rays == 0);
    for (int quarter = 0; quarter <= 80; ++quarter) {  // Twenty seconds: 100 rays/s, then 300 rays/s.
        window.add(totals, quarter * RateWindow::k_spacing);
        totals[std::size_t(Counter::rays)] += quarter < 40 ? 25 : 75;
        window.add({}, quarter * RateWindow::k_spacing + 1);  // Too soon: not taken.
    }
    CHECK(window.rates().rays == doctest::Approx(300));
    CHECK(window.rates().tiles == 0);
}

TEST_CASE("every counter, state and gauge has a line") {
    EventStore store;
    fill(store, 1);
    store.count(Counter::rays, 1234567890123);
    ClusterFigures figures;
    figures.servers[std::size_t(PeerState::ready)] = 1;
    figures.living = {ServerId{1}};
    figures.samples_left = 30;
    figures.samples_per_second = 4;
    figures.indirect = 0.5;
    const std::string text = metrics_text(store, figures, {1, 2, 3});
    for (const auto& [counter, name] : k_counter_names)
        CHECK(text.find("\n# TYPE pathscope_" + std::string(name) + "_total counter\n") != std::string::npos);
    CHECK(has_line(text, "pathscope_rays_total 1234567890123"));
    CHECK(has_line(text, "pathscope_queue_seconds 7.5"));
    CHECK(has_line(text, "pathscope_servers{state=\"ready\"} 1"));
    CHECK(has_line(text, "pathscope_servers{state=\"draining\"} 0"));
    CHECK(has_line(text, "pathscope_progress_ratio{part=\"indirect\"} 0.5"));
    CHECK(has_line(text, "pathscope_tiles_per_second 3"));
    CHECK(has_line(text, "pathscope_heartbeat_seconds_count{id=\"1\",name=\"far\"} 1"));
}

TEST_CASE("what is a counter never falls, also when an audit takes light back") {
    EventStore store;
    store.count_all({{Counter::samples, 100}, {Counter::tiles, 2}}, ServerId{1});
    store.take_back({{Counter::samples, 30}}, ServerId{1});
    CHECK(store.total(Counter::samples) == 70);
    CHECK(has_line(metrics_text(store, {}, {}), "pathscope_samples_total 100"));
    store.count(Counter::samples, 5);
    CHECK(has_line(metrics_text(store, {}, {}), "pathscope_samples_total 105"));
    CHECK(has_line(metrics_text(store, {}, {}), "pathscope_tiles_total 2"));
}

TEST_CASE("the sum of a summary never falls: it is no rounded mean times a count") {
    EventStore store;
    ClusterFigures figures;
    figures.living = {ServerId{1}};
    const auto sum = [&] {
        const std::string text = metrics_text(store, figures, {});
        const std::string name = "pathscope_heartbeat_seconds_sum{id=\"1\",name=\"far\"} ";
        const std::size_t at = text.find("\n" + name);
        REQUIRE(at != std::string::npos);
        return std::stod(text.substr(at + 1 + name.size()));
    };
    store.name_server(ServerId{1}, "far");
    for (const TimeNs duration : {3, 3, 5, 0}) store.add_latency(Latency::heartbeat, duration, ServerId{1});
    CHECK(1e9 * sum() == doctest::Approx(11));
}

TEST_CASE("a name cannot write lines of its own, and a crowd of servers not a page without end") {
    EventStore store;
    fill(store, 1000).name_server(ServerId{1}, "a\"} 1\nb\\");
    ClusterFigures figures;
    for (std::uint32_t i = 1; i <= 1000; ++i) figures.living.push_back(ServerId{i});
    const std::string text = metrics_text(store, figures, {});
    CHECK(count_of(text, "pathscope_heartbeat_seconds_count{") == k_most_servers_shown);
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        CAPTURE(line);
        CHECK((line.starts_with("# ") || line.starts_with("pathscope_")));
    }
}
