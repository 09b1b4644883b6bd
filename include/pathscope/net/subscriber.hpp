#pragma once
/// SUB: hears what a publisher says from the moment the subscription has reached it.
///
/// Thread safety: one thread (socket.hpp).   Source: ZeroMQ RFC 29.
/// Test: tests/net/test_publisher_subscriber.cpp

#include <optional>
#include <string>

#include "pathscope/core/frames.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/net/context.hpp"
#include "pathscope/net/socket.hpp"

namespace pathscope {

class SubscriberSocket {
  public:
    /// Hears messages whose first frame begins with `topic`; an empty one means all. Returns at once.
    [[nodiscard]] static Result<SubscriberSocket> connect(const Context& context, const std::string& endpoint,
                                                          const std::string& topic,
                                                          const SocketOptions& options = {});

    /// The next message that is waiting, if any. Never blocks.
    [[nodiscard]] std::optional<Frames> receive();

    [[nodiscard]] const SocketHandle& handle() const { return socket_; }
    [[nodiscard]] Pollable pollable() const { return {socket_.get()}; }

  private:
    SocketHandle socket_;
};

}  // namespace pathscope
