#pragma once
/// Waiting for what must come, without sleeping: a test ends as soon as it comes and fails if it does not.

#include <optional>
#include <string>

#include "pathscope/core/clock.hpp"
#include "pathscope/net/dealer.hpp"
#include "pathscope/net/poller.hpp"
#include "pathscope/net/router.hpp"

namespace pathscope::testing {

inline constexpr TimeNs k_patience = 10 * k_second_ns;  ///< Far beyond what is ever needed.

template <class Socket>
auto receive_soon(Socket& socket) {
    (void)wait_readable({socket.pollable()}, k_patience);
    return socket.receive();
}

/// Repeats `attempt` until it is true, waiting for the socket to stir in between.
template <class Socket, class Attempt>
bool soon(Socket& socket, Attempt attempt) {
    const TimeNs deadline = monotonic_now() + k_patience;
    while (!attempt()) {
        if (monotonic_now() > deadline) return false;
        (void)wait_readable({socket.pollable()}, 5 * k_millisecond_ns);
    }
    return true;
}

inline SendOutcome send_once_connected(DealerSocket& dealer, Frames frames) {
    (void)wait_readable({dealer.sendable()}, k_patience);
    return dealer.send(std::move(frames));
}

}  // namespace pathscope::testing
