#pragma once
/// A doorbell: any thread rings, the thread that waits on sockets wakes up.
///
///     render thread:  queue.push(tile);  wake.notify();
///     I/O thread:     wait_readable({monitor.pollable(), wake.pollable()}, timeout);
///                     wake.clear();      take all of the queue
///
/// Why: render threads must not touch sockets, and the I/O thread must not poll a queue. Rings add up to one:
/// clear before taking from the queue, and no item can be missed. It is a pipe; a ZeroMQ PAIR would itself be
/// bound to one thread at each end.
/// Thread safety: notify() from any thread and from signal handlers; clear() from the waiting thread.
/// Test: tests/net/test_poller.cpp

#include "pathscope/core/result.hpp"
#include "pathscope/net/socket.hpp"

namespace pathscope {

class WakePair {
  public:
    [[nodiscard]] static Result<WakePair> create();
    WakePair(WakePair&& other) noexcept;
    WakePair& operator=(WakePair&& other) noexcept;
    ~WakePair();

    void notify() const noexcept;
    void clear() noexcept;

    [[nodiscard]] Pollable pollable() const { return {nullptr, read_end_}; }

  private:
    WakePair(int read_end, int write_end) : read_end_(read_end), write_end_(write_end) {}

    int read_end_ = -1;
    int write_end_ = -1;
};

}  // namespace pathscope
