#include "pathscope/metrics/exposition.hpp"

#include <fmt/format.h>
#include <prometheus/text_serializer.h>

#include <algorithm>
#include <cctype>

#include "families.hpp"

namespace pathscope {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;

MetricFamily gauge(const std::string& name, const std::string& help, double value) {
    MetricFamily family{"pathscope_" + name, help, MetricType::Gauge, {}};
    family.metric.emplace_back().gauge.value = value;
    return family;
}

MetricFamily counter(std::string_view name, std::uint64_t total) {
    MetricFamily family{fmt::format("pathscope_{}_total", name),
                        fmt::format("As '{}' of --stats, with what was taken back since.", name),
                        MetricType::Counter,
                        {}};
    family.metric.emplace_back().counter.value = double(total);
    return family;
}

MetricFamily servers_by_state(const ClusterFigures& figures) {
    MetricFamily family{
        "pathscope_servers", "Servers that the client knows, by state.", MetricType::Gauge, {}};
    for (const auto& [state, name] : k_peer_state_names) {
        if (state == PeerState::dead || state == PeerState::gone)
            continue;  // Forgotten, and counted as died.
        std::string word(name);
        std::transform(word.begin(), word.end(), word.begin(),
                       [](unsigned char c) { return std::tolower(c); });
        ClientMetric& metric = family.metric.emplace_back();
        metric.label = {{"state", word}};
        metric.gauge.value = figures.servers[std::size_t(state)];
    }
    return family;
}

MetricFamily progress(const ClusterFigures& figures) {
    MetricFamily family{
        "pathscope_progress_ratio", "Share of the samples that are in the image.", MetricType::Gauge, {}};
    for (const auto& [part, value] :
         {std::pair("direct", figures.direct), std::pair("indirect", figures.indirect)}) {
        ClientMetric& metric = family.metric.emplace_back();
        metric.label = {{"part", part}};
        metric.gauge.value = value;
    }
    return family;
}

/// One summary for each server shown.
MetricFamily latencies(Latency what, const std::vector<ServerSummary>& servers) {
    constexpr double k_seconds_per_ms = 1e-3;
    MetricFamily family{fmt::format("pathscope_{}_seconds", name_of(what)),
                        what == Latency::heartbeat ? "Round trip of a heartbeat."
                                                   : "From granting a lease to merging its tile.",
                        MetricType::Summary,
                        {}};
    for (const ServerSummary& server : servers) {
        const LatencySummary& latency = server.latency(what);
        if (latency.count == 0) continue;
        ClientMetric& metric = family.metric.emplace_back();
        metric.label = {{"id", std::to_string(server.id.value)}, {"name", server.name}};
        metric.summary.sample_count = latency.count;
        metric.summary.sample_sum = latency.sum_ms * k_seconds_per_ms;
        metric.summary.quantile = {{0.5, latency.p50_ms * k_seconds_per_ms},
                                   {0.95, latency.p95_ms * k_seconds_per_ms}};
    }
    return family;
}

}  // namespace

std::vector<MetricFamily> metric_families(const EventStore& store, const ClusterFigures& figures,
                                          const CounterRates& rates) {
    std::vector<MetricFamily> families;
    const CounterTotals totals = store.totals_ever();
    for (const auto& [what, name] : k_counter_names)
        families.push_back(counter(name, totals[std::size_t(what)]));

    families.push_back(gauge("rays_per_second", "Rays traced, over the last ten seconds.", rates.rays));
    families.push_back(
        gauge("samples_per_second", "Pixel samples merged, over the last ten seconds.", rates.samples));
    families.push_back(
        gauge("tiles_per_second", "Tiles of servers merged, over the last ten seconds.", rates.tiles));
    families.push_back(gauge("samples_left", "Pixel samples of indirect light that are not in the image.",
                             figures.samples_left));
    families.push_back(gauge("speed_samples_per_second", "Sum of the measured speeds of all servers.",
                             figures.samples_per_second));
    if (const auto seconds = figures.queue_seconds())
        families.push_back(
            gauge("queue_seconds", "Work that is left, divided by the speed of all servers.", *seconds));
    families.push_back(progress(figures));
    families.push_back(servers_by_state(figures));

    std::vector<ServerSummary> shown;
    for (const ServerId id : figures.living) {
        if (shown.size() == k_most_servers_shown) break;
        if (auto server = store.server(id)) shown.push_back(std::move(*server));
    }
    for (const auto& [what, name] : k_latency_names) families.push_back(latencies(what, shown));
    return families;
}

std::string metrics_text(const EventStore& store, const ClusterFigures& figures, const CounterRates& rates) {
    return prometheus::TextSerializer().Serialize(metric_families(store, figures, rates));
}

}  // namespace pathscope
