#pragma once
/// SIGINT and SIGTERM ask a session to end, from the first moment on: one that comes before there is a session is remembered.
///
/// Who runs servers by the hundred ends some that have only just begun, and takes any other end than exit code 0 for a failure.
/// Requires: one at a time in a program, made before the session.
/// Thread safety: none; signals may come at any time.   Test: tests/system/test_faults.py

#include <atomic>
#include <csignal>

namespace pathscope {

template <class Session>
class StopSignals {
  public:
    StopSignals() {
        std::signal(SIGINT, ask);
        std::signal(SIGTERM, ask);
    }
    StopSignals(const StopSignals&) = delete;
    StopSignals& operator=(const StopSignals&) = delete;

    /// session.run(), which a signal ends by session.request_stop(); at once if one has come before.
    [[nodiscard]] auto run(Session& session) {
        session_.store(&session);
        if (asked_.load()) session.request_stop();
        auto done = session.run();
        session_.store(nullptr);
        return done;
    }

  private:
    static void ask(int) {
        asked_.store(true);
        if (Session* session = session_.load()) session->request_stop();
    }

    static inline std::atomic<bool> asked_{false};
    static inline std::atomic<Session*> session_{nullptr};
};

}  // namespace pathscope
