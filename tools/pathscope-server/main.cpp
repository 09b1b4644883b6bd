/// pathscope-server: renders indirect light for a client. No display needed.

#include <cstdio>

#include "../common/arguments.hpp"
#include "../common/stop_signals.hpp"
#include "options.hpp"
#include "pathscope/core/log.hpp"

namespace {

using namespace pathscope;

/// Until a signal or the client ends it.
template <class Session, class Options>
int run(const Options& options) {
    StopSignals<Session> signals;
    const auto session = Session::create(options);
    if (!session) return report("pathscope-server", session.error());
    const auto done = signals.run(**session);
    return done ? 0 : report("pathscope-server", done.error());
}

}  // namespace

int main(int argc, char** argv) {
    const auto parsed = parse_options(argc, argv);
    if (!parsed) return report("pathscope-server", parsed.error());
    if (const auto* text = std::get_if<std::string>(&*parsed)) {
        std::fputs(text->c_str(), stdout);
        return 0;
    }
    const auto& options = std::get<ServerOptions>(*parsed);
    if (options.quiet)
        set_log_sink([](LogLevel level, std::string_view sentence) {
            if (level == LogLevel::warning)
                std::fprintf(stderr, "warning: %.*s\n", int(sentence.size()), sentence.data());
        });
    return options.ghosts.count > 0 ? run<GhostHost>(options.ghosts) : run<ServerSession>(options.server);
}
