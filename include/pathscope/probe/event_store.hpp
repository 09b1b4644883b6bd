#pragma once
/// The event store: everything the instruments know. Panels, exports, lesson checks and statistics are pure
/// functions of it, so that a recording replayed into a store shows what the live run showed.
///
///     EventStore store;
///     store.count(Counter::samples, 1024, server);                        // level counters and full
///     if (store.keeps_events()) store.record({now, 0, {}, 0, NoteEvent{"first tile"}});   // level full
///     for (Event& event : store.events_since(cursor, 1000)) ...
///
/// Two parts. The **ring** keeps the newest events; older ones fall off and are counted. The **totals**
/// (counters, latency distributions) are kept apart from the ring and stay exact however long it runs.
///
/// Memory: at most `events` * sizeof(Event) + about 8 kB for each of at most `servers` servers. What servers
/// beyond that do counts in the overall totals only.
/// Cost: a level check, then one short mutex. Hot code adds up locally and counts once per round.
/// Invariant: no level changes what the program computes.
/// Thread safety: yes, many producers and readers. Readers get copies.
/// Test: tests/probe/test_event_store.cpp

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/probe/counter.hpp"
#include "pathscope/probe/event.hpp"
#include "pathscope/probe/latency_histogram.hpp"

namespace pathscope {

enum class ProbeLevel {
    off,       ///< Nothing is kept.
    counters,  ///< Totals and latencies.
    full,      ///< And events.
};

inline constexpr std::array k_probe_level_names{
    EnumName{ProbeLevel::off, "off"},
    EnumName{ProbeLevel::counters, "counters"},
    EnumName{ProbeLevel::full, "full"},
};
constexpr const auto& enum_table(ProbeLevel) { return k_probe_level_names; }

using CounterTotals = std::array<std::uint64_t, k_counters>;

struct LatencySummary {
    std::uint64_t count = 0;
    double mean_ms = 0, p50_ms = 0, p95_ms = 0, largest_ms = 0;  ///< 0 while count is 0.
    double sum_ms = 0;                                           ///< Never falls.
};

/// What the store knows about one server (0: the client's own renderer).
struct ServerSummary {
    ServerId id;
    std::string name;
    CounterTotals totals{};
    std::array<LatencySummary, k_latencies> latencies;

    [[nodiscard]] std::uint64_t total(Counter counter) const { return totals[std::size_t(counter)]; }
    [[nodiscard]] const LatencySummary& latency(Latency what) const { return latencies[std::size_t(what)]; }
};

class EventStore {
  public:
    struct Limits {
        std::size_t events = 1 << 16;
        std::size_t servers = 4096;
    };

    explicit EventStore(ProbeLevel level = ProbeLevel::counters) : EventStore(level, Limits{}) {}
    EventStore(ProbeLevel level, Limits limits);

    // -- Producers ------------------------------------------------------------------------------------------
    void set_level(ProbeLevel level) { level_.store(level, std::memory_order_relaxed); }
    [[nodiscard]] ProbeLevel level() const { return level_.load(std::memory_order_relaxed); }
    [[nodiscard]] bool keeps_counters() const { return level() != ProbeLevel::off; }
    [[nodiscard]] bool keeps_events() const { return level() == ProbeLevel::full; }

    /// Adds to the overall total and to the server's.
    void count(Counter counter, std::uint64_t n = 1, ServerId server = k_local_server);

    /// Several at once, under one lock.
    struct Count {
        Counter counter;
        std::uint64_t n;
    };
    void count_all(std::initializer_list<Count> counts, ServerId server = k_local_server);

    /// What was counted for light that is in the picture no more. Requires: it was counted.
    void take_back(std::initializer_list<Count> counts, ServerId server);

    /// What other runs counted before, which this one goes on from: in the overall totals, and of no server.
    void count_earlier(std::initializer_list<Count> counts);

    /// Negative durations (clocks of two machines) count as 0.
    void add_latency(Latency what, TimeNs duration, ServerId server);

    /// A name for people, of bounded length: statistics and traces show it. Kept at every level.
    void name_server(ServerId server, std::string_view name);

    /// Appends to the ring at level full; sets the sequence number. The oldest event falls off a full ring.
    void record(Event event);

    /// Records a CounterEvent for each counter that rose since the last call: plots over time.
    void sample_counters(TimeNs now);

    // -- Readers --------------------------------------------------------------------------------------------
    [[nodiscard]] std::uint64_t total(Counter counter) const;
    [[nodiscard]] CounterTotals totals() const;
    /// With what was taken back since: numbers that never fall, as who draws rates of them expects.
    [[nodiscard]] CounterTotals totals_ever() const;
    [[nodiscard]] std::optional<ServerSummary> server(ServerId server) const;
    [[nodiscard]] std::vector<ServerSummary> servers()
        const;  ///< By rising id, those that were named or counted.

    /// Up to `limit` events with a sequence number above `sequence`, oldest first. Events that fell off are
    /// skipped: a gap between `sequence` and the first one shows it.
    [[nodiscard]] std::vector<Event> events_since(std::uint64_t sequence, std::size_t limit) const;

    /// Calls visitor(event) for every event above `sequence`, oldest first, in pieces, so that producers are
    /// never held up for long. Returns the last sequence number visited.
    template <class Visitor>
    std::uint64_t visit_since(std::uint64_t sequence, Visitor&& visitor) const {
        for (;;) {
            const std::vector<Event> piece = events_since(sequence, 512);
            if (piece.empty()) return sequence;
            for (const Event& event : piece) visitor(event);
            sequence = piece.back().sequence;
        }
    }

    [[nodiscard]] std::uint64_t recorded() const;  ///< Events ever: the last sequence number given.
    [[nodiscard]] std::uint64_t fallen_off() const;

  private:
    struct ServerTotals {
        std::string name;
        CounterTotals totals{};
        std::array<LatencyHistogram, k_latencies> latencies;
    };

    [[nodiscard]] ServerTotals* totals_of(ServerId server);
    [[nodiscard]] static ServerSummary summarise(ServerId id, const ServerTotals& totals);
    void append(Event&& event);

    const Limits limits_;
    std::atomic<ProbeLevel> level_;

    mutable std::mutex mutex_;  ///< Guards all below.
    std::vector<Event> ring_;   ///< Event n is at (n - 1) % limits_.events.
    std::uint64_t recorded_ = 0;
    CounterTotals totals_{};
    CounterTotals taken_back_{};
    CounterTotals sampled_{};
    std::map<ServerId, ServerTotals> servers_;
    std::map<ServerId, ServerTotals>::value_type* last_counted_ =
        nullptr;  ///< Who comes, comes several times in a row.
};

}  // namespace pathscope
