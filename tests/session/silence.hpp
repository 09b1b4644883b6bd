#pragma once
/// The machines tell people what happens; in a test of thousands of events nobody reads it.

#include <string_view>

#include "pathscope/core/log.hpp"

namespace pathscope::testing {

class Silence {
  public:
    Silence() : before_(set_log_sink([](LogLevel, std::string_view) {})) {}
    ~Silence() { set_log_sink(before_); }
    Silence(const Silence&) = delete;
    Silence& operator=(const Silence&) = delete;

  private:
    LogSink before_;
};

}  // namespace pathscope::testing
