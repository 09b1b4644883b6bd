#include "pathscope/core/log.hpp"

#include <cstdio>
#include <mutex>
#include <utility>

namespace pathscope {
namespace {

std::mutex& sink_mutex() {
    static std::mutex mutex;
    return mutex;
}

LogSink& current_sink() {
    static LogSink sink;
    return sink;
}

void emit(LogLevel level, std::string_view sentence) {
    const std::lock_guard lock(sink_mutex());
    if (const LogSink& sink = current_sink()) return sink(level, sentence);
    std::fprintf(stderr, "%s: %.*s\n", level == LogLevel::warning ? "warning" : "note",
                 static_cast<int>(sentence.size()), sentence.data());
}

}  // namespace

LogSink set_log_sink(LogSink sink) {
    const std::lock_guard lock(sink_mutex());
    return std::exchange(current_sink(), std::move(sink));
}

void log_note(std::string_view sentence) { emit(LogLevel::note, sentence); }
void log_warning(std::string_view sentence) { emit(LogLevel::warning, sentence); }

}  // namespace pathscope
