#pragma once
/// DEALER: the many that talk to one ROUTER, without waiting for answers in turn.
///
/// A dealer here has one connection, dials for ever, and sends only over a connection that stands
/// (IMMEDIATE): before that, and after the router went away, send() says would_block and nothing is buffered.
/// Why a fresh id per incarnation: a ROUTER keeps the id of a connection it has not yet noticed to be dead,
/// and refuses or blackholes a peer that returns under the same one (libzmq issues 778, 2019, 2892).
/// Thread safety: one thread (socket.hpp).   Source: ZeroMQ RFC 28.   Test: tests/net/test_router_dealer.cpp

#include <optional>
#include <string>

#include "pathscope/core/frames.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/net/connection_watch.hpp"
#include "pathscope/net/context.hpp"
#include "pathscope/net/socket.hpp"

namespace pathscope {

/// 16 random bytes of the operating system, of which the first is not zero: ZeroMQ keeps ids that begin with
/// zero for peers that named none.
[[nodiscard]] std::string random_routing_id();

struct WatchedDealer;

class DealerSocket {
  public:
    /// Returns at once: the peer need not be there yet. Requires: routing_id as above (1 to 255 bytes).
    [[nodiscard]] static Result<DealerSocket> connect(const Context& context, const std::string& endpoint,
                                                      const std::string& routing_id,
                                                      const SocketOptions& options = {});

    /// The same, watched from before the first attempt: after a handshake that one side refuses, ZeroMQ does not try
    /// again, and says so only here. Whoever wants to has to connect anew.
    [[nodiscard]] static Result<WatchedDealer> connect_watched(const Context& context,
                                                               const std::string& endpoint,
                                                               const std::string& routing_id,
                                                               const SocketOptions& options = {});

    /// delivered or would_block. Never blocks. Takes the frames only when `delivered`. Requires: a frame.
    [[nodiscard]] SendOutcome send(Frames&& frames);

    /// The next message that is waiting, if any. Never blocks.
    [[nodiscard]] std::optional<Frames> receive();

    [[nodiscard]] const SocketHandle& handle() const { return socket_; }
    [[nodiscard]] Pollable pollable() const { return {socket_.get()}; }

    /// Ready when send() would deliver: as soon as the connection stands. Only for while one waits to send.
    [[nodiscard]] Pollable sendable() const { return {socket_.get(), -1, true}; }

  private:
    [[nodiscard]] static Result<DealerSocket> open(const Context& context, const std::string& routing_id,
                                                   const SocketOptions& options);

    SocketHandle socket_;
};

struct WatchedDealer {
    DealerSocket dealer;
    ConnectionWatch watch;
};

}  // namespace pathscope
