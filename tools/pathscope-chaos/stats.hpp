#pragma once
/// What --stats writes.

#include <string>

#include "pathscope/net/chaos_relay.hpp"

namespace pathscope {

[[nodiscard]] std::string chaos_stats_json(const ChaosRelayConfig& config, const ChaosRelayStats& stats);

}  // namespace pathscope
