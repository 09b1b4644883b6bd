#pragma once
/// Sentences for people: notes and warnings on stderr, one line each.
///
/// A sink can be set (tests count warnings, the window shows them). Errors are not logged but returned
/// (result.hpp). Thread safety: yes.

#include <functional>
#include <string>
#include <string_view>
#include <utility>

namespace pathscope {

enum class LogLevel { note, warning };

using LogSink = std::function<void(LogLevel, std::string_view sentence)>;

/// Replaces the sink; an empty one restores stderr. Returns the sink that was set before.
LogSink set_log_sink(LogSink sink);

/// The same, until the end of the scope.
class ScopedLogSink {
  public:
    explicit ScopedLogSink(LogSink sink) : before_(set_log_sink(std::move(sink))) {}
    ~ScopedLogSink() { set_log_sink(std::move(before_)); }
    ScopedLogSink(const ScopedLogSink&) = delete;
    ScopedLogSink& operator=(const ScopedLogSink&) = delete;

  private:
    LogSink before_;
};

void log_note(std::string_view sentence);
void log_warning(std::string_view sentence);

}  // namespace pathscope
