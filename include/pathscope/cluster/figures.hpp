#pragma once
/// How a frame stands with its servers, at a moment: what is left, who works on it, and how long that will take.
///
///     queue seconds = remaining samples / (speed_1 + ... + speed_N)
///
/// Why: the one number that says whether there are enough servers, whatever the frame and whatever the machines; an engine
/// that starts servers (docs/cluster.md) steers by it.
/// Convention: nothing, not infinity, while no speed is known: who steers by it then leaves things as they are.
/// Units: samples are pixel samples of indirect light; seconds. Thread safety: values.
/// Test: tests/metrics/test_exposition.cpp

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "pathscope/cluster/peer.hpp"
#include "pathscope/core/ids.hpp"

namespace pathscope {

struct ClusterFigures {
    std::array<int, k_peer_state_names.size()> servers{};  ///< By PeerState; those that live.
    std::vector<ServerId> living;                          ///< Of those, by rising id.
    double samples_left = 0;
    double samples_per_second = 0;    ///< Sum of the measured speeds of those that are given work.
    double direct = 0, indirect = 0;  ///< Done, 0 to 1.

    [[nodiscard]] std::optional<double> queue_seconds() const {
        if (samples_left <= 0) return 0;
        if (samples_per_second <= 0) return std::nullopt;
        return samples_left / samples_per_second;
    }
};

}  // namespace pathscope
