/// pathscope-server: renders indirect light for a client. No display needed.

#include <atomic>
#include <csignal>
#include <cstdio>

#include "../common/arguments.hpp"
#include "options.hpp"
#include "pathscope/core/log.hpp"

namespace {

using namespace pathscope;

template <class Session>
std::atomic<Session*> g_running{nullptr};

template <class Session>
void stop(int) {
    if (Session* session = g_running<Session>.load()) session->request_stop();
}

/// Until a signal or the client ends it.
template <class Session>
int run(const Result<std::unique_ptr<Session>>& session) {
    if (!session) return report("pathscope-server", session.error());
    g_running<Session>.store(session->get());
    std::signal(SIGINT, stop<Session>);
    std::signal(SIGTERM, stop<Session>);
    const auto done = (*session)->run();
    g_running<Session>.store(nullptr);
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
    return options.ghosts.count > 0 ? run(GhostHost::create(options.ghosts))
                                    : run(ServerSession::create(options.server));
}
