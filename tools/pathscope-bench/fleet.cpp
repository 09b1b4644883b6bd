#include "fleet.hpp"

#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <ctime>
#include <fstream>
#include <functional>
#include <numeric>

#include "pathscope/core/clock.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/session/child_process.hpp"

namespace pathscope::bench {
namespace {

constexpr TimeNs k_patience = 300 * k_second_ns;
constexpr TimeNs k_longest_step = 50 * k_millisecond_ns;

double resident_kib() {
    std::ifstream file("/proc/self/statm");
    double all = 0, resident = 0;
    file >> all >> resident;
    return resident * double(::sysconf(_SC_PAGESIZE)) / 1024;
}

double cpu_seconds(clockid_t clock) {
    timespec time{};
    ::clock_gettime(clock, &time);
    return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

Result<std::vector<ChildProcess>> start(const Fleet& fleet, const ClientSession& client) {
    const auto port = [&](std::size_t i) {
        return client.endpoints()[i].substr(client.endpoints()[i].rfind(':') + 1);
    };
    std::vector<std::string> arguments{"--quiet", "--ports",
                                       fmt::format("{},{},{}", port(0), port(1), port(2))};
    const auto add = [&](std::initializer_list<std::string> more) {
        arguments.insert(arguments.end(), more);
    };
    if (fleet.ghosts)
        add({"--ghost", std::to_string(fleet.servers), "--ghost-speed", to_text(fleet.speed), "--ghost-seed",
             std::to_string(fleet.speed_seed)});
    else
        add({"--threads", "1", "--speed-cap", fmt::format("{}", fleet.speed_cap)});
    std::vector<ChildProcess> processes;
    for (int i = 0; i < (fleet.ghosts ? 1 : fleet.servers); ++i) {
        auto process = ChildProcess::start(program_folder() / "pathscope-server", arguments);
        if (!process) return process.error();
        processes.push_back(std::move(*process));
    }
    return processes;
}

Result<void> step_until(ClientSession& client, const std::string& what, const std::function<bool()>& done) {
    for (const TimeNs limit = monotonic_now() + k_patience; !done(); client.step(k_longest_step))
        if (monotonic_now() > limit) return failed("Waited too long until " + what + ".");
    return {};
}

/// Times the rest of the frame.
Result<void> finish(ClientSession& client, FrameFigures& figures) {
    const TimeNs begun = monotonic_now();
    const double main_begun = cpu_seconds(CLOCK_THREAD_CPUTIME_ID);
    const double process_begun = cpu_seconds(CLOCK_PROCESS_CPUTIME_ID);
    if (auto ok = step_until(client, "the frame was complete", [&] { return client.complete(); }); !ok)
        return ok;
    figures.render_s = to_seconds(monotonic_now() - begun);
    figures.main_cpu_s = cpu_seconds(CLOCK_THREAD_CPUTIME_ID) - main_begun;
    figures.process_cpu_s = cpu_seconds(CLOCK_PROCESS_CPUTIME_ID) - process_begun;
    const RenderSettings& settings = client.state().settings;
    figures.samples = double(settings.width) * double(settings.height) * double(settings.spp);
    figures.tiles = client.work().indirect_ledger().rounds_committed();
    figures.leases = client.work().indirect_ledger().counts().granted;
    return {};
}

}  // namespace

double Fleet::samples_per_second() const {
    if (!ghosts) return servers * speed_cap;
    const std::vector<double> speeds = ghost_speeds(speed, servers, speed_seed);
    return std::accumulate(speeds.begin(), speeds.end(), 0.0);
}

Result<FrameFigures> render_frame(ClientConfig config, const ClientJob& job, const Fleet& fleet) {
    const ScopedLogSink only_warnings([](LogLevel level, std::string_view sentence) {
        if (level == LogLevel::warning)
            fmt::print(stderr, "warning: {}\n", sentence);  // Servers come and go.
    });
    config.listens = config.any_ports = true;
    config.min_servers = fleet.servers;
    EventStore store;
    const auto client = ClientSession::create(config, job, store);
    if (!client) return client.error();
    ::malloc_trim(0);  // So that what earlier runs left behind does not hide what this one takes.
    const double kib_before = resident_kib();

    FrameFigures figures;
    const TimeNs started = monotonic_now();
    const auto processes = start(fleet, **client);
    if (!processes) return processes.error();
    if (auto ok =
            step_until(**client, "all servers were ready", [&] { return !(*client)->progress().waiting; });
        !ok)
        return ok.error();
    figures.join_s = to_seconds(monotonic_now() - started);
    if (auto ok = finish(**client, figures); !ok) return ok.error();
    figures.kib_per_server = (resident_kib() - kib_before) / fleet.servers;
    return figures;
}

Result<FrameFigures> render_frame_alone(ClientConfig config, const ClientJob& job) {
    EventStore store;
    const auto client = ClientSession::create(config, job, store);
    if (!client) return client.error();
    FrameFigures figures;
    if (auto ok = finish(**client, figures); !ok) return ok.error();
    return figures;
}

}  // namespace pathscope::bench
