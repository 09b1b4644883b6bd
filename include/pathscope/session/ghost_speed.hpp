#pragma once
/// How fast each of a crowd of ghosts is (ghost_host.hpp).
///
///     speed_i = median * exp(sigma z_i),   z_i ~ Normal(0, 1) from hash(seed, i)
///
/// Why: machines of a cluster are not alike, and a schedule is judged by what it makes of that. The speeds follow from
/// the seed, so that who measures efficiency knows their sum without asking: work / (time * sum of speeds).
/// Units: samples of pixels per second. sigma: 0 = all alike; 0.4 = a third of the machines are off by half or more.
/// Thread safety: values.   Test: tests/session/test_ghost_host.cpp

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pathscope/core/result.hpp"

namespace pathscope {

struct GhostSpeed {
    double median = 100'000;
    double sigma = 0;  ///< Of the logarithm.

    friend bool operator==(const GhostSpeed&, const GhostSpeed&) = default;
};

/// "SAMPLES_PER_S" or "SAMPLES_PER_S,lognormal:SIGMA". Refuses speeds outside [1, 1e12] and sigmas outside [0, 2].
[[nodiscard]] Result<GhostSpeed> parse_ghost_speed(std::string_view text);
[[nodiscard]] std::string to_text(const GhostSpeed& speed);

/// Speed of each of `count` ghosts. The first n are the same for any count >= n.
[[nodiscard]] std::vector<double> ghost_speeds(const GhostSpeed& speed, int count, std::uint32_t seed);

}  // namespace pathscope
