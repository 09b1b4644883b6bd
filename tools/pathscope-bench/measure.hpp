#pragma once
/// What every benchmark does the same way: wait for a quiet median, and never time one rival alone.
///
///   median(values)              of an even number of runs, the mean of the middle two
///   geometric_mean(ratios)      exp(mean of ln): 2 and 1/2 cancel out, whichever of the two is called the peer
///
/// interleave(runs, rivals) times A B C, A B C, ... after one round that is thrown away (cold caches, page faults).
/// Why: on a machine that others use as well, a slow minute hits all rivals alike, so that the *ratio within a round* is
/// steady where figures taken one after the other are not.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ctime>
#include <functional>
#include <utility>
#include <vector>

#include "pathscope/core/check.hpp"
#include "pathscope/core/clock.hpp"

namespace pathscope::bench {

/// A median of fewer runs than these is no figure to publish.
inline constexpr int k_min_runs = 5;

/// Requires: at least one value.
[[nodiscard]] inline double median(std::vector<double> values) {
    CHECK(!values.empty());
    std::sort(values.begin(), values.end());
    const std::size_t middle = values.size() / 2;
    return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

/// Requires: at least one value, all above 0.
[[nodiscard]] inline double geometric_mean(const std::vector<double>& values) {
    CHECK(!values.empty());
    double sum = 0;
    for (const double value : values) sum += std::log(value);
    return std::exp(sum / double(values.size()));
}

/// Measures each rival once per round, in turns; gives what they measured: seconds, a rate, whatever the benchmark compares.
/// Element [rival][run].
template <class Value>
[[nodiscard]] std::vector<std::vector<Value>> interleave(int runs,
                                                         const std::vector<std::function<Value()>>& rivals) {
    for (const auto& warm_up : rivals) (void)warm_up();
    std::vector<std::vector<Value>> measured(rivals.size());
    for (int run = 0; run < runs; ++run)
        for (std::size_t rival = 0; rival < rivals.size(); ++rival)
            measured[rival].push_back(rivals[rival]());
    return measured;
}

/// What a piece of work takes. Why both: the first is what people wait for, the second what they would wait for, times
/// the threads, if nobody else used the machine.
struct Cost {
    double wall_s = 0;
    double cpu_s = 0;  ///< Of all threads together.
};

template <class Work>
[[nodiscard]] Cost cost_of(Work&& work) {
    const TimeNs begin = monotonic_now();
    const std::clock_t cpu_begin = std::clock();
    work();
    return {to_seconds(monotonic_now() - begin), double(std::clock() - cpu_begin) / CLOCKS_PER_SEC};
}

[[nodiscard]] inline Cost median(const std::vector<Cost>& costs) {
    std::vector<double> wall, cpu;
    for (const Cost& cost : costs) {
        wall.push_back(cost.wall_s);
        cpu.push_back(cost.cpu_s);
    }
    return {median(std::move(wall)), median(std::move(cpu))};
}

}  // namespace pathscope::bench
