#include "pathscope/probe/event_store.hpp"

#include <algorithm>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

LatencySummary summarise_latency(const LatencyHistogram& histogram) {
    LatencySummary summary;
    summary.count = histogram.count();
    if (summary.count == 0) return summary;
    summary.sum_ms = to_milliseconds(histogram.sum());
    summary.mean_ms = to_milliseconds(*histogram.mean());
    summary.p50_ms = to_milliseconds(*histogram.quantile(0.50));
    summary.p95_ms = to_milliseconds(*histogram.quantile(0.95));
    summary.largest_ms = to_milliseconds(*histogram.largest());
    return summary;
}

}  // namespace

EventStore::EventStore(ProbeLevel level, Limits limits) : limits_(limits), level_(level) {
    CHECK(limits.events > 0 && limits.servers > 0, limits.events, limits.servers);
}

void EventStore::count(Counter counter, std::uint64_t n, ServerId server) {
    count_all({{counter, n}}, server);
}

void EventStore::count_all(std::initializer_list<Count> counts, ServerId server) {
    if (!keeps_counters()) return;
    const std::lock_guard lock(mutex_);
    ServerTotals* const of_server = totals_of(server);
    for (const auto& [counter, n] : counts) {
        const auto index = static_cast<std::size_t>(counter);
        totals_[index] += n;
        if (of_server != nullptr) of_server->totals[index] += n;
    }
}

void EventStore::take_back(std::initializer_list<Count> counts, ServerId server) {
    if (!keeps_counters()) return;
    const std::lock_guard lock(mutex_);
    ServerTotals* const of_server = totals_of(server);
    for (const auto& [counter, n] : counts) {
        const auto index = static_cast<std::size_t>(counter);
        totals_[index] -= n;
        taken_back_[index] += n;
        if (of_server != nullptr) of_server->totals[index] -= n;
    }
}

void EventStore::count_earlier(std::initializer_list<Count> counts) {
    if (!keeps_counters()) return;
    const std::lock_guard lock(mutex_);
    for (const auto& [counter, n] : counts) totals_[static_cast<std::size_t>(counter)] += n;
}

void EventStore::add_latency(Latency what, TimeNs duration, ServerId server) {
    if (!keeps_counters()) return;
    const std::lock_guard lock(mutex_);
    if (ServerTotals* const of_server = totals_of(server))
        of_server->latencies[static_cast<std::size_t>(what)].add(std::max<TimeNs>(0, duration));
}

void EventStore::name_server(ServerId server, std::string_view name) {
    const std::lock_guard lock(mutex_);
    if (ServerTotals* const of_server = totals_of(server)) of_server->name = BoundedText<64>(name).view();
}

void EventStore::record(Event event) {
    if (!keeps_events()) return;
    const std::lock_guard lock(mutex_);
    append(std::move(event));
}

void EventStore::sample_counters(TimeNs now) {
    if (!keeps_events()) return;
    const std::lock_guard lock(mutex_);
    for (const auto& [counter, name] : k_counter_names) {
        const auto index = static_cast<std::size_t>(counter);
        if (totals_[index] == sampled_[index]) continue;
        sampled_[index] = totals_[index];
        append({now, 0, k_local_server, 0, CounterEvent{counter, totals_[index]}});
    }
}

std::uint64_t EventStore::total(Counter counter) const {
    const std::lock_guard lock(mutex_);
    return totals_[static_cast<std::size_t>(counter)];
}

CounterTotals EventStore::totals() const {
    const std::lock_guard lock(mutex_);
    return totals_;
}

CounterTotals EventStore::totals_ever() const {
    const std::lock_guard lock(mutex_);
    CounterTotals ever = totals_;
    for (std::size_t i = 0; i < ever.size(); ++i) ever[i] += taken_back_[i];
    return ever;
}

std::optional<ServerSummary> EventStore::server(ServerId server) const {
    const std::lock_guard lock(mutex_);
    const auto found = servers_.find(server);
    if (found == servers_.end()) return std::nullopt;
    return summarise(found->first, found->second);
}

std::vector<ServerSummary> EventStore::servers() const {
    const std::lock_guard lock(mutex_);
    std::vector<ServerSummary> summaries;
    summaries.reserve(servers_.size());
    for (const auto& [id, totals] : servers_) summaries.push_back(summarise(id, totals));
    return summaries;
}

std::vector<Event> EventStore::events_since(std::uint64_t sequence, std::size_t limit) const {
    const std::lock_guard lock(mutex_);
    const std::uint64_t oldest = recorded_ - ring_.size() + 1;
    const std::uint64_t begin = std::max(sequence + 1, oldest);
    std::vector<Event> events;
    if (begin > recorded_) return events;
    const std::uint64_t end = begin + std::min<std::uint64_t>(limit, recorded_ - begin + 1);
    events.reserve(end - begin);
    for (std::uint64_t n = begin; n < end; ++n) events.push_back(ring_[(n - 1) % limits_.events]);
    return events;
}

std::uint64_t EventStore::recorded() const {
    const std::lock_guard lock(mutex_);
    return recorded_;
}

std::uint64_t EventStore::fallen_off() const {
    const std::lock_guard lock(mutex_);
    return recorded_ - ring_.size();
}

EventStore::ServerTotals* EventStore::totals_of(ServerId server) {
    if (last_counted_ != nullptr && last_counted_->first == server) return &last_counted_->second;
    auto found = servers_.find(server);
    if (found == servers_.end()) {
        if (servers_.size() >= limits_.servers) return nullptr;
        found = servers_.try_emplace(server).first;
    }
    last_counted_ = &*found;
    return &found->second;
}

ServerSummary EventStore::summarise(ServerId id, const ServerTotals& totals) {
    ServerSummary summary{id, totals.name, totals.totals, {}};
    for (std::size_t i = 0; i < k_latencies; ++i)
        summary.latencies[i] = summarise_latency(totals.latencies[i]);
    return summary;
}

void EventStore::append(Event&& event) {
    event.sequence = ++recorded_;
    if (ring_.size() == limits_.events) {
        ring_[(recorded_ - 1) % limits_.events] = std::move(event);
        return;
    }
    // Grown by hand: the vector's own doubling could reserve twice the limit.
    if (ring_.size() == ring_.capacity())
        ring_.reserve(std::min(limits_.events, std::max<std::size_t>(256, 2 * ring_.size())));
    ring_.push_back(std::move(event));
}

}  // namespace pathscope
