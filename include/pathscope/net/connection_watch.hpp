#pragma once
/// Connections as they come and go, told by ZeroMQ itself.
///
/// A process that dies closes its connection, and that is known here within milliseconds, long before
/// heartbeats miss it. ZeroMQ does not say whose connection it was: send each peer something, and the dead
/// one is `unreachable` (router.hpp). A machine that hangs or a cable that is cut closes nothing; that is
/// what heartbeats are for.
///
///     const ConnectionChanges changes = watch.take_changes();
///     if (changes.lost > 0) ping_all_servers();
///
/// Requires: take_changes() is called whenever pollable() is ready, as events are kept until they are taken.
/// Thread safety: one thread, any; the watched socket may live in another.   Source: zmq_socket_monitor(3).
/// Test: tests/net/test_connection_watch.cpp

#include "pathscope/core/result.hpp"
#include "pathscope/net/router.hpp"
#include "pathscope/net/socket.hpp"

namespace pathscope {

struct ConnectionChanges {
    int accepted = 0;  ///< Connections that completed the handshake.
    int lost = 0;      ///< Connections that ended, by either side or by a broken line.
    int refused = 0;   ///< Handshakes that failed: no key, a wrong key, or no ZeroMQ at all.
    bool operator==(const ConnectionChanges&) const = default;
};

class ConnectionWatch {
  public:
    /// Requires: the router is not being watched already.
    [[nodiscard]] static Result<ConnectionWatch> watch(const Context& context, const RouterSocket& router);

    /// What happened since the last call, of at most 1,000 events.
    [[nodiscard]] ConnectionChanges take_changes();

    [[nodiscard]] Pollable pollable() const { return {socket_.get()}; }

  private:
    SocketHandle socket_;
};

}  // namespace pathscope
