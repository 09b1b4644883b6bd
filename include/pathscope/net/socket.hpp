#pragma once
/// What every socket has in common: options, outcomes of sending, bounded draining.
///
/// ZeroMQ sockets are not thread safe: a socket belongs to the one thread that uses it (it may be handed over
/// to another, once, with a memory barrier as std::thread gives). Other threads leave work in a queue and
/// ring the WakePair (wake_pair.hpp). Nothing here blocks but wait_readable() (poller.hpp) and the end of a
/// Context.
/// Addresses: "tcp://127.0.0.1:5556", "tcp://*:5556", "tcp://127.0.0.1:*" (any free port), "ipc:///tmp/name",
/// "inproc://name". Interrupted system calls (EINTR) are no errors: the call is repeated, or a wait ends
/// early.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "pathscope/core/frames.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/net/context.hpp"
#include "pathscope/net/security.hpp"

namespace pathscope {

/// Limits that keep one peer from taking all memory, and the times of the transport.
struct SocketOptions {
    std::int64_t max_frame_bytes =
        (8 << 20) + (64 << 10);   ///< A peer that sends a larger frame is disconnected.
    int send_limit = 1000;        ///< Messages waiting to be sent, per peer; beyond: would_block or dropped.
    int receive_limit = 1000;     ///< Messages waiting to be received, per peer; beyond: the peer waits.
    int linger_ms = 0;            ///< How long unsent messages outlive their socket.
    int reconnect_ms = 100;       ///< First pause before dialling again, doubling...
    int reconnect_max_ms = 5000;  ///< ...up to this.
    /// A silent connection is pinged so often, and closed after six unanswered pings. Far slower than the
    /// session's heartbeats, so that a server that is only frozen is judged by the failure detector and not
    /// by the transport.
    int transport_heartbeat_ms = 5000;
    /// Who has connected and not yet said who it is, by ZeroMQ's handshake, is shown out after this time.
    int handshake_ms = 10'000;
    int backlog = 4096;  ///< Connections waiting to be accepted: servers may join by the hundred.
    Security security;   ///< Keys (security.hpp); none by default.
};

enum class SendOutcome {
    delivered,    ///< Handed to the connection. It may still be lost with it.
    unreachable,  ///< No such peer is connected (any more).
    would_block,  ///< The peer does not keep up (send_limit), or a dealer has no connection yet.
};

/// A thing that wait_readable() can wait for. Valid as long as the socket it came from.
struct Pollable {
    void* socket = nullptr;  ///< A ZeroMQ socket, or null:
    int descriptor = -1;     ///< a file descriptor.
    bool to_send = false;    ///< Wait until it can send instead of until it can receive.
};

/// An open ZeroMQ socket; closed at the end. Keeps its context alive.
struct OpenSocket {
    std::shared_ptr<ContextState> context;
    void* socket;
    ~OpenSocket();
};

/// The ZeroMQ socket inside each of our sockets. Moves; a ConnectionWatch may ask whether it is still open.
class SocketHandle {
  public:
    SocketHandle() = default;
    SocketHandle(std::shared_ptr<ContextState> context, void* socket)
        : open_(new OpenSocket{std::move(context), socket}) {}

    [[nodiscard]] void* get() const { return open_ ? open_->socket : nullptr; }
    [[nodiscard]] const ContextState& context() const { return *open_->context; }
    [[nodiscard]] std::weak_ptr<OpenSocket> watched() const { return open_; }

  private:
    std::shared_ptr<OpenSocket> open_;
};

/// Handles at most `at_most` waiting messages and returns how many there were: with more than one socket or a
/// timer, one busy peer must not starve the rest. A ROUTER takes from its peers in turn.
template <class Socket, class Handle>
int drain(Socket& socket, int at_most, Handle&& handle) {
    int count = 0;
    while (count < at_most) {
        auto message = socket.receive();
        if (!message) break;
        handle(std::move(*message));
        ++count;
    }
    return count;
}

}  // namespace pathscope
