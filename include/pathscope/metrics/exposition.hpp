#pragma once
/// A run's figures in the text format of Prometheus: what an engine steers by, and what a dashboard draws.
///
///     # HELP pathscope_queue_seconds Work that is left, divided by the speed of all servers.
///     # TYPE pathscope_queue_seconds gauge
///     pathscope_queue_seconds 12.5
///
/// Names follow the rules of prometheus.io/docs/practices/naming: counters end in _total, units are base units (seconds,
/// bytes). Every counter of probe/counter.hpp is there by its own name; docs/cluster.md lists all others.
/// Bounded: a label takes values from a fixed list, but for id and name of a server, of which at most k_most_servers_shown
/// are shown at once, the oldest of those that live; totals and distributions of the others still count in the totals.
/// Thread safety: pure; the store may be in use.   Test: tests/metrics/test_exposition.cpp

#include <cstddef>
#include <string>

#include "pathscope/cluster/figures.hpp"
#include "pathscope/metrics/rate_window.hpp"
#include "pathscope/probe/event_store.hpp"

namespace pathscope {

inline constexpr std::size_t k_most_servers_shown = 64;

[[nodiscard]] std::string metrics_text(const EventStore& store, const ClusterFigures& figures,
                                       const CounterRates& rates);

}  // namespace pathscope
