/// pathscope-chaos: a TCP relay that disturbs what it relays, on command.

#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <thread>

#include "../common/arguments.hpp"
#include "options.hpp"
#include "pathscope/core/clock.hpp"
#include "pathscope/core/files.hpp"
#include "pathscope/net/poller.hpp"
#include "pathscope/net/wake_pair.hpp"
#include "stats.hpp"

namespace {

using namespace pathscope;

const WakePair* g_bell = nullptr;
volatile std::sig_atomic_t g_stopping = 0;
void stop(int) {
    g_stopping = 1;
    g_bell->notify();
}

void obey(ChaosRelay& relay, const Result<ChaosCommand>& command) {
    const Result<void> done = command ? relay.apply(*command) : Result<void>(command.error());
    if (!done) report("pathscope-chaos", done.error());
}

/// Takes what there is to read, and obeys the lines that are complete. Returns whether more may come.
bool obey_standard_input(ChaosRelay& relay, std::string& unfinished) {
    char bytes[4096];
    const ssize_t got = ::read(STDIN_FILENO, bytes, sizeof bytes);
    if (got < 0 && errno == EINTR) return true;
    if (got > 0) unfinished.append(bytes, std::size_t(got));
    const bool over = got <= 0;
    if (over && !unfinished.empty()) unfinished += '\n';
    for (std::size_t end; (end = unfinished.find('\n')) != std::string::npos; unfinished.erase(0, end + 1))
        if (end > 0) obey(relay, parse_chaos_command(unfinished.substr(0, end)));
    if (unfinished.size() > sizeof bytes) unfinished.clear();  // No command is that long.
    return !over;
}

/// Hands the relay commands, those of the schedule from the `next` one on at their times, until a signal
/// says stop.
void command(ChaosRelay& relay, const std::vector<ScheduledChaos>& schedule, std::size_t next, TimeNs start,
             const WakePair& bell) {
    bool listening = true;
    std::string unfinished;
    while (!g_stopping) {
        TimeNs timeout = -1;
        if (next < schedule.size())
            timeout = std::max<TimeNs>(0, start + schedule[next].at - monotonic_now());
        std::vector<Pollable> heard{bell.pollable()};
        if (listening) heard.push_back({nullptr, STDIN_FILENO});
        const Readable ready = wait_readable(heard, timeout);
        for (; next < schedule.size() && start + schedule[next].at <= monotonic_now(); ++next)
            obey(relay, schedule[next].command);
        if (listening && ready[1]) listening = obey_standard_input(relay, unfinished);
    }
}

/// One line for scripts: where this listens, in the form that --connect takes.
void say_where(const ChaosRelayConfig& config, const std::vector<int>& ports) {
    std::string host = config.listen_host, list;
    if (host.find(':') != std::string::npos) host = "[" + host + "]";
    for (const int port : ports) list += (list.empty() ? "" : ",") + std::to_string(port);
    std::printf("listening %s:%s\n", host.c_str(), list.c_str());
    std::fflush(stdout);
}

Result<void> run(const ChaosOptions& options) {
    auto bell = WakePair::create();
    if (!bell) return bell.error();
    const auto relay = ChaosRelay::create(options.relay);
    if (!relay) return relay.error();
    for (const ScheduledChaos& line : options.schedule)
        if (const auto fits = (*relay)->check(line.command); !fits)
            return bad_input(
                fmt::format("{}: line {}: {}", options.schedule_file, line.line, fits.error().message));

    g_bell = &*bell;
    std::signal(SIGINT, stop);
    std::signal(SIGTERM, stop);
    std::signal(SIGTTIN, SIG_IGN);  // In the background of a terminal, standard input just ends.
    say_where(options.relay, (*relay)->ports());

    // What is due from the start is there before the first connection.
    std::size_t next = 0;
    for (; next < options.schedule.size() && options.schedule[next].at == 0; ++next)
        obey(**relay, options.schedule[next].command);
    std::thread loop([&] { (*relay)->run(monotonic_now); });
    command(**relay, options.schedule, next, monotonic_now(), *bell);
    (*relay)->request_stop();
    loop.join();
    if (options.stats_file.empty()) return {};
    return write_file_atomically(options.stats_file, chaos_stats_json(options.relay, (*relay)->stats()));
}

}  // namespace

int main(int argc, char** argv) {
    const auto options = parse_chaos_options(argc, argv);
    if (!options) return report("pathscope-chaos", options.error());
    if (const auto* text = std::get_if<std::string>(&*options)) {
        std::fputs(text->c_str(), stdout);
        return 0;
    }
    const auto done = run(std::get<ChaosOptions>(*options));
    return done ? 0 : report("pathscope-chaos", done.error());
}
