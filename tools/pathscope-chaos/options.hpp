#pragma once
/// The command line of pathscope-chaos.

#include <string>
#include <variant>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/net/chaos_relay.hpp"

namespace pathscope {

struct ChaosOptions {
    ChaosRelayConfig relay;
    std::string schedule_file, stats_file;  ///< Empty: none.
    std::vector<ScheduledChaos> schedule;
};

/// Options to run with, or the text that --help and --version ask for.
[[nodiscard]] Result<std::variant<ChaosOptions, std::string>> parse_chaos_options(int argc,
                                                                                  const char* const* argv);

}  // namespace pathscope
