#pragma once
/// The command line of pathscope-relay.

#include <string>
#include <variant>

#include "pathscope/core/result.hpp"
#include "pathscope/session/relay_session.hpp"

namespace pathscope {

struct RelayOptions {
    RelayConfig relay;
    bool quiet = false;
};

/// The options; or, for --help and --version, the text to print.
[[nodiscard]] Result<std::variant<RelayOptions, std::string>> parse_options(int argc,
                                                                            const char* const* argv);

}  // namespace pathscope
