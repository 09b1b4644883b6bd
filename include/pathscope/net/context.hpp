#pragma once
/// The ZeroMQ context: the I/O threads that move messages, and the namespace of inproc:// addresses.
///
/// One per process is the rule. Sockets keep their context alive, so that the order in which a context and
/// its sockets go out of scope does not matter: the last one to go waits for what linger allows to be sent.
/// Thread safety: yes.   Test: tests/net/test_router_dealer.cpp

#include <memory>

namespace pathscope {

struct ContextOptions {
    int io_threads = 1;  ///< One moves about 1 GB/s.
    int max_sockets =
        4096;  ///< Sockets in this process, of inproc peers too; TCP peers of one socket do not count.
};

class ContextState;  // Of this module alone.

class Context {
  public:
    explicit Context(const ContextOptions& options = {});

    /// Only for this module.
    [[nodiscard]] const std::shared_ptr<ContextState>& state() const { return state_; }

  private:
    std::shared_ptr<ContextState> state_;
};

}  // namespace pathscope
