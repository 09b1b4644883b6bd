#include "pathscope/cluster/credit_policy.hpp"

#include <algorithm>

namespace pathscope {

std::size_t credit_window(std::optional<TimeNs> round_trip, std::optional<TimeNs> round_time) {
    if (!round_trip || !round_time || *round_trip <= 0) return k_least_credits;
    const TimeNs one = std::max<TimeNs>(*round_time, 1);
    const TimeNs meanwhile = (*round_trip - 1) / one + 1;
    return std::size_t(std::clamp<TimeNs>(meanwhile, k_least_credits - 1, k_most_credits - 1)) + 1;
}

std::size_t most_leases(std::uint64_t result_bytes) {
    return std::size_t(std::max<std::uint64_t>(1, k_owed_bytes / std::max<std::uint64_t>(1, result_bytes)));
}

}  // namespace pathscope
