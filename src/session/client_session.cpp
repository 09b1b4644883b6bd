#include "pathscope/session/client_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pathscope/core/log.hpp"
#include "pathscope/net/poller.hpp"

namespace pathscope {
namespace {

constexpr TimeNs k_child_watch = 50 * k_millisecond_ns;  ///< How often children are looked at.
constexpr TimeNs k_own_pause = k_second_ns;  ///< A step later than this after the last: we were stopped.

/// Servers must not know which rounds are audited.
ClientConfig with_secret(ClientConfig config) {
    if (config.audit.secret == 0) config.audit.secret = random_session();
    return config;
}

}  // namespace

Result<std::unique_ptr<ClientSession>> ClientSession::create(const ClientConfig& config, ClientJob job,
                                                             EventStore& store) {
    Result<WakePair> wake = WakePair::create();
    if (!wake) return wake.error();
    const std::optional<CheckpointFile> file = std::exchange(job.resume, std::nullopt);
    std::unique_ptr<ClientSession> session(
        new ClientSession(config, std::move(job), store, std::move(*wake)));
    if (file)
        if (const auto resumed = session->machine_.resume(*file); !resumed) return resumed.error();
    if (config.local_servers > 0 || config.listens)
        if (const auto opened = session->open_sockets(); !opened) return opened.error();
    if (const auto started = session->start_local_servers(); !started) return started.error();
    return session;
}

ClientSession::ClientSession(const ClientConfig& config, ClientJob job, EventStore& store, WakePair wake)
    : config_(config),
      store_(store),
      wake_(std::move(wake)),
      runner_(wake_, config.threads),
      machine_(with_secret(config), std::move(job), random_session(), store, *this, monotonic_now()),
      last_step_(monotonic_now()) {}

ClientSession::~ClientSession() { machine_.say_goodbye(monotonic_now()); }

Result<void> ClientSession::open_sockets() {
    (void)own_bits();  // Rendered before there is a heartbeat to be late for.
    Result<ClientSockets> sockets = ClientSockets::open(context_, config_);
    if (!sockets) return sockets.error();
    sockets_.emplace(std::move(*sockets));
    endpoints_ = sockets_->endpoints();
    return {};
}

Result<void> ClientSession::start_local_servers() {
    for (int i = 0; i < config_.local_servers; ++i) {
        const std::string name = fmt::format("server-{}", i + 1);
        std::vector<std::string> arguments{
            "--connect", config_.host,
            "--ports",   fmt::format("{},{},{}", config_.ports[0], config_.ports[1], config_.ports[2]),
            "--threads", std::to_string(config_.local_server_threads),
            "--name",    name,
            "--bvh",     std::string(name_of(config_.tree)),
            "--quiet"};
        if (!config_.local_server_mesh_cache.empty())
            arguments.insert(arguments.end(), {"--mesh-cache", config_.local_server_mesh_cache});
        for (std::string& argument : sockets_->door().arguments_of_local_server(i))
            arguments.push_back(std::move(argument));
        auto process = ChildProcess::start(config_.server_program, arguments);
        if (!process) return process.error();
        machine_.expect_server(std::uint32_t(process->pid()), name);
        local_servers_.push_back({std::move(*process), name});
    }
    return {};
}

void ClientSession::step(TimeNs max_wait) {
    TimeNs now = monotonic_now();
    TimeNs next = machine_.next_timer(now);
    if (!local_servers_.empty()) next = std::min(next, now + k_child_watch);
    std::vector<Pollable> pollables{wake_.pollable()};
    if (sockets_)
        for (const Pollable& pollable : sockets_->pollables()) pollables.push_back(pollable);
    const Readable ready = wait_readable(pollables, std::clamp<TimeNs>(next - now, 0, max_wait));
    now = monotonic_now();
    if (now - last_step_ > k_own_pause + max_wait) machine_.on_own_pause(now - last_step_);
    last_step_ = now;

    if (ready[0]) wake_.clear();
    if (sockets_) sockets_->receive(ready, 1, machine_);
    for (RoundOutcome& outcome : runner_.take_finished()) machine_.on_outcome(outcome, monotonic_now());
    if (sockets_) sockets_->watch_door(ready, 1, store_, machine_);
    watch_local_servers();
    machine_.on_timers(monotonic_now());
}

void ClientSession::watch_local_servers() {
    for (LocalServer& local : local_servers_) {
        const auto ending = local.ended ? std::nullopt : local.process.ending();
        if (!ending) continue;
        local.ended = true;
        machine_.on_process_ended(std::uint32_t(local.process.pid()), local.name, *ending, monotonic_now());
    }
}

bool ClientSession::send(Channel channel, const std::string& instance, Frames frames) {
    return sockets_->send(channel, instance, std::move(frames));
}

void ClientSession::publish(Frames frames) {
    if (sockets_) sockets_->publish(std::move(frames));
}

}  // namespace pathscope
