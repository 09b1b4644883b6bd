/// pathscope-relay: stands for its servers towards a client. No display, no renderer.

#include <cstdio>

#include "../common/arguments.hpp"
#include "../common/stop_signals.hpp"
#include "options.hpp"
#include "pathscope/core/log.hpp"

namespace {

using namespace pathscope;

void say_warnings_only(LogLevel level, std::string_view sentence) {
    if (level == LogLevel::warning)
        std::fprintf(stderr, "warning: %.*s\n", int(sentence.size()), sentence.data());
}

}  // namespace

int main(int argc, char** argv) {
    const auto parsed = parse_options(argc, argv);
    if (!parsed) return report("pathscope-relay", parsed.error());
    if (const auto* text = std::get_if<std::string>(&*parsed)) {
        std::fputs(text->c_str(), stdout);
        return 0;
    }
    const auto& options = std::get<RelayOptions>(*parsed);
    if (options.quiet) set_log_sink(say_warnings_only);
    StopSignals<RelaySession> signals;
    const auto session = RelaySession::create(options.relay);
    if (!session) return report("pathscope-relay", session.error());
    const auto done = signals.run(**session);
    return done ? 0 : report("pathscope-relay", done.error());
}
