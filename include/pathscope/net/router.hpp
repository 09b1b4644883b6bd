#pragma once
/// ROUTER: one socket, many peers, each with a name.
///
///     RouterSocket    binds; receive() tells who spoke, send() names who shall hear it
///
/// Why "mandatory": a plain ROUTER drops messages for peers it does not know or that do not keep up,
/// silently. With ROUTER_MANDATORY both are told to the sender, and a peer that died is noticed by the next
/// message to it instead of by a timeout.
/// Why no handover: a peer whose id is taken is refused. Peers choose fresh random ids (dealer.hpp), so a
/// taken id is either the same peer's dead connection or an impostor.
/// A listener with keys hears nobody whose key is not on the list at that moment (security.hpp): what a revoked peer
/// still sends is dropped unread, and its connection ended.
/// Thread safety: one thread (socket.hpp).   Source: ZeroMQ RFC 28, zguide chapter 3.
/// Test: tests/net/test_router_dealer.cpp

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pathscope/core/frames.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/net/context.hpp"
#include "pathscope/net/socket.hpp"

namespace pathscope {

struct RoutedMessage {
    std::string peer;  ///< Routing id: any bytes, at most 255.
    Frames frames;     ///< Without the routing id.
    /// What the peer cannot choose: the public key that it entered with, and its machine's address. Either is empty
    /// where it is not known: the key without keys, the address of a peer that speaks ZeroMQ's first version.
    std::string key{}, address{};
};

class RouterSocket {
  public:
    /// A port that is taken, a bad address: one sentence that names the endpoint.
    [[nodiscard]] static Result<RouterSocket> bind(const Context& context, const std::string& endpoint,
                                                   const SocketOptions& options = {});

    /// The endpoint really bound: of "tcp://127.0.0.1:*", the port that was free.
    [[nodiscard]] const std::string& endpoint() const { return endpoint_; }

    /// Never blocks. Takes the frames only when the outcome is `delivered`. Requires: at least one frame.
    [[nodiscard]] SendOutcome send(const std::string& peer, Frames&& frames);

    /// The next message that is waiting, if any. Never blocks.
    [[nodiscard]] std::optional<RoutedMessage> receive();

    /// Peers whose messages were dropped since the last call because their keys are no longer listed.
    [[nodiscard]] std::vector<std::string> take_revoked() { return std::exchange(revoked_, {}); }

    [[nodiscard]] const SocketHandle& handle() const { return socket_; }
    [[nodiscard]] Pollable pollable() const { return {socket_.get()}; }

  private:
    SocketHandle socket_;
    std::string endpoint_;
    bool has_keys_ = false;
    std::vector<std::string> revoked_;
};

}  // namespace pathscope
