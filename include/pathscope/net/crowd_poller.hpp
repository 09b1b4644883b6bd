#pragma once
/// Wait for thousands of sockets, at the cost of those that stirred.
///
///     CrowdPoller poller = *CrowdPoller::create();
///     poller.add(dealer.pollable(), 17);
///     for (std::uint64_t key : poller.wait(timeout)) receive_all(sockets[key]);
///
/// Why beside wait_readable(): zmq_poll asks every socket each time, by two system calls; that is a millisecond for 2,000
/// sockets of which one has a message. ZeroMQ gives each socket a file descriptor (ZMQ_FD) that becomes readable when the
/// I/O thread has news for it, and epoll names those alone.
/// The price is a rule. The descriptor tells of *news*, not of messages, and any call on the socket may take the news in.
/// So a socket must be received from **until nothing is left** after it was added, whenever wait() names it, and after
/// every send on it; otherwise a message may lie there unannounced.
/// Units: nanoseconds, rounded up to whole milliseconds; negative = without end. A signal ends the wait early.
/// Thread safety: the thread that owns the sockets.   Source: zmq_getsockopt(3), ZMQ_FD.
/// Test: tests/net/test_crowd_poller.cpp

#include <cstdint>
#include <vector>

#include "pathscope/core/clock.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/net/socket.hpp"

namespace pathscope {

class CrowdPoller {
  public:
    [[nodiscard]] static Result<CrowdPoller> create();
    CrowdPoller(CrowdPoller&& other) noexcept;
    CrowdPoller& operator=(CrowdPoller&& other) noexcept;
    ~CrowdPoller();

    /// Requires: not there yet, and to receive from.
    void add(const Pollable& pollable, std::uint64_t key);
    /// To be called before the socket is closed. Requires: was added.
    void remove(const Pollable& pollable);

    /// The keys of those that stirred, each once. Valid until the next call.
    [[nodiscard]] const std::vector<std::uint64_t>& wait(TimeNs timeout);

  private:
    explicit CrowdPoller(int descriptor) : descriptor_(descriptor) {}

    int descriptor_ = -1;
    std::vector<std::uint64_t> stirred_;
};

}  // namespace pathscope
