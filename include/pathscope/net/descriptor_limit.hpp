#pragma once
/// How many files and sockets this process may have open.
///
/// Why: a connection is a descriptor, and shells commonly allow 1,024 of them, though any user may raise that up to a hard
/// limit that is far higher. ZeroMQ does not tell when it runs out: connections are then silently not accepted.
/// Thread safety: yes.   Source: getrlimit(2).   Test: tests/net/test_crowd_poller.cpp

#include <cstddef>

namespace pathscope {

/// Raises the limit to at least `wanted` if the system lets us. Returns the limit that holds, which may be less.
std::size_t raise_descriptor_limit(std::size_t wanted);

}  // namespace pathscope
