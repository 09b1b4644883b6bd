#pragma once
/// Wait for several sockets at once.
///
///     const Readable ready = wait_readable({monitor.pollable(), wake.pollable()}, timeout);
///     if (ready[0]) drain(monitor, 100, handle_monitor);
///
/// Why a function and no object: sockets come and go (a server that lost its client opens new ones), and a
/// list made for each wait cannot hold a socket that is closed.
/// Units: nanoseconds, from a millisecond on rounded up to whole ones; negative = without end. A signal ends the wait
/// early, with nothing readable.
/// Thread safety: the thread that owns the sockets.   Test: tests/net/test_poller.cpp

#include <bitset>
#include <cstddef>
#include <initializer_list>
#include <span>

#include "pathscope/core/clock.hpp"
#include "pathscope/net/socket.hpp"

namespace pathscope {

inline constexpr std::size_t k_max_pollables = 16;
using Readable = std::bitset<k_max_pollables>;  ///< Bit i: pollable i is ready.

/// Requires: at most k_max_pollables.
[[nodiscard]] Readable wait_readable(std::span<const Pollable> pollables, TimeNs timeout);
[[nodiscard]] inline Readable wait_readable(std::initializer_list<Pollable> pollables, TimeNs timeout) {
    return wait_readable(std::span(pollables.begin(), pollables.size()), timeout);
}

}  // namespace pathscope
