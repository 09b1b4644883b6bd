#include "pathscope/cluster/lease_size.hpp"

#include <algorithm>

#include "pathscope/core/check.hpp"

namespace pathscope {

std::uint32_t rounds_per_lease(TimeNs lease_time, std::optional<TimeNs> round_time,
                               std::uint64_t rounds_waiting, std::uint64_t places) {
    CHECK(lease_time >= 0 && places > 0, lease_time, places);
    if (!round_time) return 1;
    const auto worth_a_lease = std::uint64_t(lease_time / std::max<TimeNs>(*round_time, 1));
    const std::uint64_t share = rounds_waiting / (2 * places);
    return std::uint32_t(std::clamp<std::uint64_t>(std::min(worth_a_lease, share), 1, ~0u));
}

}  // namespace pathscope
