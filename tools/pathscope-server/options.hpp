#pragma once
/// The command line of pathscope-server.

#include <string>
#include <variant>

#include "pathscope/core/result.hpp"
#include "pathscope/session/ghost_host.hpp"
#include "pathscope/session/server_session.hpp"

namespace pathscope {

struct ServerOptions {
    ServerConfig server;
    GhostConfig ghosts;  ///< In place of the server, if their count is not 0.
    bool quiet = false;
};

/// The options; or, for --help and --version, the text to print.
[[nodiscard]] Result<std::variant<ServerOptions, std::string>> parse_options(int argc,
                                                                             const char* const* argv);

}  // namespace pathscope
