#include "stats.hpp"

#include <nlohmann/json.hpp>

#include "pathscope/session/build_identity.hpp"

namespace pathscope {
namespace {

nlohmann::ordered_json direction_json(const ChaosLinkStats& link, std::size_t d) {
    const ChaosCounts& counts = link.directions[d];
    return {{"bytes_in", counts.bytes_in},
            {"bytes_out", counts.bytes_out},
            {"bytes_dropped", counts.bytes_dropped},
            {"most_held_bytes", counts.most_held_bytes},
            {"flips", counts.flips},
            {"half_closes", link.half_closes[d]}};
}

nlohmann::ordered_json link_json(const ChaosLinkStats& link) {
    return {{"port", link.port},
            {"target_port", link.target_port},
            {"connections", link.connections},
            {"cuts", link.cuts},
            {"resets", link.resets},
            {"refused", link.refused},
            {"unreachable", link.unreachable},
            {"up", direction_json(link, 0)},
            {"down", direction_json(link, 1)}};
}

}  // namespace

std::string chaos_stats_json(const ChaosRelayConfig& config, const ChaosRelayStats& stats) {
    nlohmann::ordered_json links = nlohmann::ordered_json::array();
    for (const ChaosLinkStats& link : stats.links) links.push_back(link_json(link));
    const nlohmann::ordered_json all = {{"version", program_version()},
                                        {"seed", config.seed},
                                        {"commands", stats.commands},
                                        {"links", links}};
    return all.dump(2) + "\n";
}

}  // namespace pathscope
