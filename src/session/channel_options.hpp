#pragma once
/// What the sockets of both sides have in common: the largest frame of their channel, and time for a BYE to leave.

#include <utility>

#include "pathscope/net/socket.hpp"
#include "pathscope/protocol/table.hpp"

namespace pathscope {

[[nodiscard]] inline SocketOptions channel_options(Channel channel, Security security = {}) {
    SocketOptions options;
    options.max_frame_bytes = std::int64_t(max_frame_bytes(channel));
    options.linger_ms = 200;
    options.security = std::move(security);
    return options;
}

}  // namespace pathscope
