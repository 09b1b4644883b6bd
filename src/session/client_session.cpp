#include "pathscope/session/client_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pathscope/core/log.hpp"
#include "pathscope/net/dealer.hpp"
#include "pathscope/net/descriptor_limit.hpp"
#include "pathscope/net/poller.hpp"

namespace pathscope {
namespace {

constexpr int k_messages_per_turn = 200;  ///< Per socket, so that heartbeats are never starved.
constexpr TimeNs k_child_watch = 50 * k_millisecond_ns;  ///< How often children are looked at.
constexpr std::size_t k_wanted_descriptors =
    3 * 4096 + 256;                          ///< Three connections of each server we may take.
constexpr TimeNs k_own_pause = k_second_ns;  ///< A step later than this after the last: we were stopped.

std::uint64_t random_session() {
    const std::string bytes = random_routing_id();
    std::uint64_t number = 0;
    for (int i = 0; i < 8; ++i) number = number << 8 | std::uint8_t(bytes[std::size_t(i)]);
    return std::max<std::uint64_t>(number, 1);
}

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
    raise_descriptor_limit(k_wanted_descriptors);
    const auto endpoint = [&](std::size_t channel, bool any_port) {
        return any_port ? fmt::format("tcp://{}:*", config_.host)
                        : fmt::format("tcp://{}:{}", config_.host, config_.ports[channel]);
    };
    Result<Door> door = Door::open(context_, config_);
    if (!door) return door.error();
    const auto open = [&](bool any_port) -> Result<Sockets> {
        auto input = PublisherSocket::bind(context_, endpoint(0, any_port), door->options(Channel::input));
        if (!input) return input.error();
        auto monitor = RouterSocket::bind(context_, endpoint(1, any_port), door->options(Channel::monitor));
        if (!monitor) return monitor.error();
        auto frames = RouterSocket::bind(context_, endpoint(2, any_port), door->options(Channel::frames));
        if (!frames) return frames.error();
        return Sockets{std::move(*input), std::move(*monitor), std::move(*frames)};
    };

    Result<Sockets> sockets = open(config_.any_ports);
    const bool may_move = !config_.ports_were_chosen && !config_.listens;
    const bool moved = !sockets && may_move;
    if (moved) sockets = open(true);
    if (!sockets) return sockets.error();
    sockets_ = std::move(*sockets);
    door_ = std::move(*door);
    const auto watched = door_->watch(sockets_->input, sockets_->monitor, sockets_->frames);
    if (!watched) return watched.error();
    endpoints_ = {sockets_->input.endpoint(), sockets_->monitor.endpoint(), sockets_->frames.endpoint()};
    for (std::size_t i = 0; i < endpoints_.size(); ++i)
        config_.ports[i] = std::stoi(endpoints_[i].substr(endpoints_[i].rfind(':') + 1));
    if (moved)
        log_note(fmt::format("The default ports are in use; this run takes {}, {} and {}.", config_.ports[0],
                             config_.ports[1], config_.ports[2]));
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
        for (std::string& argument : door_->arguments_of_local_server(i))
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
    if (sockets_) {
        pollables.insert(pollables.end(), {sockets_->monitor.pollable(), sockets_->frames.pollable(),
                                           sockets_->input.pollable()});
        for (const Pollable& connections : door_->pollables()) pollables.push_back(connections);
    }
    const Readable ready = wait_readable(pollables, std::clamp<TimeNs>(next - now, 0, max_wait));
    now = monotonic_now();
    if (now - last_step_ > k_own_pause + max_wait) machine_.on_own_pause(now - last_step_);
    last_step_ = now;

    if (ready[0]) wake_.clear();
    if (ready[1]) receive(sockets_->monitor, Channel::monitor);
    if (ready[2]) receive(sockets_->frames, Channel::frames);
    if (ready[3]) sockets_->input.count_subscriptions();
    for (RoundOutcome& outcome : runner_.take_finished()) machine_.on_outcome(outcome, monotonic_now());
    watch_door();
    watch_local_servers();
    machine_.on_timers(monotonic_now());
}

void ClientSession::receive(RouterSocket& socket, Channel channel) {
    drain(socket, k_messages_per_turn, [&](RoutedMessage message) {
        const Sender sender{std::move(message.key), std::move(message.address)};
        machine_.on_message(message.peer, std::move(message.frames), channel, monotonic_now(), sender);
    });
}

/// Who was turned away is counted; who hung up is looked for; who was taken off the list is given up at once.
void ClientSession::watch_door() {
    if (!door_) return;
    const TimeNs now = monotonic_now();
    const Door::News news = door_->step(now, sockets_->input);
    if (news.refused > 0) store_.count(Counter::refused_peers, news.refused);
    if (news.lost > 0) machine_.on_connection_lost(now);
    for (RouterSocket* socket : {&sockets_->monitor, &sockets_->frames})
        for (const std::string& instance : socket->take_revoked())
            machine_.on_revoked(instance, "Its key was taken off the list.", now);
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
    RouterSocket& socket = channel == Channel::monitor ? sockets_->monitor : sockets_->frames;
    return socket.send(instance, std::move(frames)) == SendOutcome::delivered;
}

void ClientSession::publish(Frames frames) {
    if (sockets_) sockets_->input.publish(std::move(frames));
}

}  // namespace pathscope
