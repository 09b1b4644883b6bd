#include "pathscope/cluster/lease_policy.hpp"

#include <algorithm>

namespace pathscope {
namespace {

constexpr TimeNs k_shortest = k_second_ns / 2;
constexpr TimeNs k_longest_usual = 6 * k_second_ns;
constexpr TimeNs k_longest = 3600 * k_second_ns;
constexpr std::uint32_t k_most_doublings = 3;
constexpr double k_weight_of_newest = 0.25;

}  // namespace

void SpeedEstimate::add(double work, TimeNs duration) {
    if (!(work > 0) || duration <= 0) return;
    const double newest = to_seconds(duration) / work;
    seconds_per_work_ += (measured() ? k_weight_of_newest : 1) * (newest - seconds_per_work_);
}

std::optional<TimeNs> SpeedEstimate::predict(double work) const {
    if (!measured()) return std::nullopt;
    return from_seconds(std::min(work * seconds_per_work_, to_seconds(k_longest)));
}

void Turnaround::add(TimeNs since_grant) {
    mean_ns_ += (mean_ns_ > 0 ? k_weight_of_newest : 1) * (double(since_grant) - mean_ns_);
}

TimeNs Turnaround::when_idle(TimeNs render_time, std::size_t in_turn) const {
    return std::max(render_time, mean() - TimeNs(in_turn - 1) * render_time);
}

TimeNs lease_duration(std::optional<TimeNs> predicted, std::uint32_t attempts) {
    TimeNs duration = k_longest_usual;
    if (predicted) {
        const TimeNs expected = std::clamp<TimeNs>(*predicted, 0, k_longest);
        duration = std::clamp(4 * expected, k_shortest, std::max(k_longest_usual, 2 * expected));
    }
    return std::min(duration << std::min(attempts, k_most_doublings), k_longest);
}

}  // namespace pathscope
