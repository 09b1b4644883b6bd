#pragma once
/// PUB: one says it, all who listen hear it. Who is late or slow misses it.
///
/// Messages to a subscriber that does not keep up (send_limit) are dropped for that subscriber alone, and a
/// subscription takes effect only when it has arrived here: the "slow joiner" loses what was published
/// before. Inside this is an XPUB, which is a PUB that sees subscriptions arrive, so the publisher can tell
/// how many there are. Correctness must not hang on delivery; the session numbers its messages and offers
/// snapshots.
/// Thread safety: one thread (socket.hpp).   Source: ZeroMQ RFC 29, zguide chapter 5.
/// Test: tests/net/test_publisher_subscriber.cpp

#include <deque>
#include <string>

#include "pathscope/core/frames.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/net/context.hpp"
#include "pathscope/net/socket.hpp"

namespace pathscope {

class PublisherSocket {
  public:
    [[nodiscard]] static Result<PublisherSocket> bind(const Context& context, const std::string& endpoint,
                                                      const SocketOptions& options = {});

    [[nodiscard]] const std::string& endpoint() const { return endpoint_; }

    /// To all subscribers whose topic the first frame begins with. Never blocks. Requires: at least one
    /// frame.
    void publish(Frames&& frames);

    /// Takes in what arrived (at most 1,000 subscriptions a call) and returns how many subscriptions stand:
    /// one for each subscriber of ours. Call it when pollable() is readable.
    int count_subscriptions();

    /// Shows out those subscribers of a listener with keys whose keys are no longer on the list (security.hpp). To be
    /// called when the list has changed; a subscriber says nothing by which it could be noticed later.
    void disconnect_unlisted();

    [[nodiscard]] const SocketHandle& handle() const { return socket_; }
    [[nodiscard]] Pollable pollable() const { return {socket_.get()}; }

  private:
    struct Subscriber {
        std::string key, address;
        int descriptor;
        bool operator==(const Subscriber&) const = default;
    };

    void remember(Subscriber subscriber);

    SocketHandle socket_;
    std::string endpoint_;
    int subscriptions_ = 0;
    bool has_keys_ = false;
    std::deque<Subscriber> subscribers_;  ///< With keys only; the latest, and some of them gone.
};

}  // namespace pathscope
