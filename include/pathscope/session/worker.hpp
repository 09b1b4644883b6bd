#pragma once
/// A thread that does jobs one after the other, and a mailbox that its results come back by.
///
///     Mailbox<Tile> tiles(wake);
///     worker.post([&] { tiles.put(render(...)); });     // on the worker's thread
///     for (Tile& tile : tiles.take_all()) send(tile);   // on the I/O thread, after the wake-up
///
/// Why: sockets belong to the I/O thread, and rendering must never hold it up, or heavy work would look like death to
/// the failure detectors.
/// Thread safety: post(), put() and take_all() from any thread.   Test: tests/session/test_worker.cpp

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "pathscope/net/wake_pair.hpp"

namespace pathscope {

class Worker {
  public:
    Worker() : thread_([this] { run(); }) {}

    /// Jobs that have not begun are dropped; the running one is waited for.
    ~Worker() {
        {
            const std::lock_guard lock(mutex_);
            ending_ = true;
            jobs_.clear();
        }
        changed_.notify_one();
        thread_.join();
    }
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    /// Requires: job does not throw.
    void post(std::function<void()> job) {
        {
            const std::lock_guard lock(mutex_);
            jobs_.push_back(std::move(job));
        }
        changed_.notify_one();
    }

  private:
    void run() {
        for (;;) {
            std::unique_lock lock(mutex_);
            changed_.wait(lock, [this] { return ending_ || !jobs_.empty(); });
            if (ending_) return;
            const std::function<void()> job = std::move(jobs_.front());
            jobs_.pop_front();
            lock.unlock();
            job();
        }
    }

    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<std::function<void()>> jobs_;
    bool ending_ = false;
    std::thread thread_;  // Last, so that it starts when the rest is there.
};

template <class T>
class Mailbox {
  public:
    /// Requires: `wake` outlives the mailbox.
    explicit Mailbox(const WakePair& wake) : wake_(&wake) {}

    void put(T item) {
        {
            const std::lock_guard lock(mutex_);
            items_.push_back(std::move(item));
        }
        wake_->notify();
    }

    [[nodiscard]] std::vector<T> take_all() {
        const std::lock_guard lock(mutex_);
        return std::exchange(items_, {});
    }

  private:
    const WakePair* wake_;
    std::mutex mutex_;
    std::vector<T> items_;
};

}  // namespace pathscope
