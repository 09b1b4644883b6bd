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

    [[nodiscard]] Pollable pollable() const { return {socket_.get()}; }

  private:
    SocketHandle socket_;
    std::string endpoint_;
    int subscriptions_ = 0;
};

}  // namespace pathscope
