#include "pathscope/cluster/credit_policy.hpp"

#include <algorithm>

namespace pathscope {

std::size_t credit_window(std::optional<TimeNs> round_trip, std::optional<TimeNs> round_time,
                          std::size_t at_once) {
    std::size_t meanwhile = k_least_credits - 1;
    if (round_trip && round_time && *round_trip > 0) {
        const TimeNs one = std::max<TimeNs>(*round_time, 1);
        meanwhile = std::size_t(std::clamp<TimeNs>((*round_trip - 1) / one + 1, 1, k_most_credits));
    }
    return std::min(at_once + meanwhile, k_most_credits);
}

std::size_t credit_share(std::uint64_t result_bytes, std::size_t servers) {
    const std::uint64_t all = k_shared_bytes / std::max<std::uint64_t>(1, result_bytes);
    return std::size_t(std::clamp<std::uint64_t>(all / servers, k_least_credits, k_most_credits));
}

std::size_t most_leases(std::uint64_t result_bytes) {
    return std::size_t(std::max<std::uint64_t>(1, k_owed_bytes / std::max<std::uint64_t>(1, result_bytes)));
}

}  // namespace pathscope
