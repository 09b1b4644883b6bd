#pragma once
/// The same figures as the library's own structures, which both its text and its HTTP server take.

#include <prometheus/metric_family.h>

#include <vector>

#include "pathscope/metrics/exposition.hpp"

namespace pathscope {

[[nodiscard]] std::vector<prometheus::MetricFamily> metric_families(const EventStore& store,
                                                                    const ClusterFigures& figures,
                                                                    const CounterRates& rates);

}  // namespace pathscope
