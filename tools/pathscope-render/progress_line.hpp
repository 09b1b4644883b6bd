#pragma once
/// One line on a terminal that says how far the frame is; nothing where standard error is no terminal.

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

#include "pathscope/session/client_session.hpp"

namespace pathscope {

class ProgressLine {
  public:
    ProgressLine() : shown_(::isatty(STDERR_FILENO) != 0), begin_(monotonic_now()) {}
    ~ProgressLine() {
        if (shown_ && drawn_) std::fputs("\r\033[K", stderr);
    }
    ProgressLine(const ProgressLine&) = delete;
    ProgressLine& operator=(const ProgressLine&) = delete;

    void show(const Progress& progress) {
        const TimeNs now = monotonic_now();
        if (!shown_ || now - last_ < k_pause) return;
        last_ = now;
        drawn_ = true;
        const double done = (progress.direct + progress.indirect) / 2;
        if (begun_with_ < 0) begun_with_ = done;  // A resumed frame begins with something.
        const double gained = done - begun_with_;
        const std::string left =
            gained > 0.01 ? fmt::format("{:.0f} s left", to_seconds(now - begin_) * (1 - done) / gained) : "";
        const std::string who = progress.waiting ? "waiting for servers"
                                : progress.alone ? "alone"
                                                 : fmt::format("{} servers", progress.servers_ready);
        fmt::print(stderr, "\r\033[Kdirect {:3.0f} %  indirect {:3.0f} %  {}  {}", 100 * progress.direct,
                   100 * progress.indirect, who, left);
        std::fflush(stderr);
    }

  private:
    static constexpr TimeNs k_pause = 200 * k_millisecond_ns;

    bool shown_;
    bool drawn_ = false;
    TimeNs begin_;
    double begun_with_ = -1;
    TimeNs last_ = 0;
};

}  // namespace pathscope
