#pragma once
/// What is logged goes here instead of to stderr, until the end of the scope.
/// Not for what other threads log while it is read.

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "pathscope/core/log.hpp"

namespace pathscope::testing {

class LogCapture {
  public:
    LogCapture()
        : sink_([this](LogLevel level, std::string_view sentence) {
              const bool warns = level == LogLevel::warning;
              (warns ? warnings : notes).emplace_back(sentence);
              said.push_back((warns ? "warning: " : "note: ") + std::string(sentence));
          }) {}

    [[nodiscard]] int count(std::string_view part) const {
        return int(std::count_if(said.begin(), said.end(), [part](const std::string& sentence) {
            return sentence.find(part) != std::string::npos;
        }));
    }

    std::vector<std::string> warnings, notes;
    std::vector<std::string> said;  ///< Both, as stderr would show them.

  private:
    ScopedLogSink sink_;
};

}  // namespace pathscope::testing
