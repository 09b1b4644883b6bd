#include "pathscope/session/client_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "pathscope/core/log.hpp"
#include "pathscope/net/dealer.hpp"
#include "pathscope/net/poller.hpp"
#include "pathscope/protocol/block_result.hpp"
#include "pathscope/session/build_identity.hpp"

namespace pathscope {
namespace {

constexpr int k_messages_per_turn = 200;       ///< Per socket, so that heartbeats are never starved.
constexpr std::uint32_t k_server_credits = 2;  ///< One round in work, one waiting: no pause between them.
constexpr std::size_t k_local_rounds = 2;      ///< The same for the client's own renderer.
constexpr TimeNs k_child_watch = 50 * k_millisecond_ns;  ///< How often children are looked at.
constexpr TimeNs k_join_patience =
    20 * k_second_ns;  ///< A local server that has not joined by then is not waited for.
constexpr TimeNs k_own_pause = k_second_ns;  ///< A step later than this after the last: we were stopped.
constexpr TimeNs k_who_pause = k_second_ns;
constexpr std::size_t k_max_unknown_peers = 256;
constexpr std::size_t k_max_servers = 4096;

std::uint64_t random_session() {
    const std::string bytes = random_routing_id();
    std::uint64_t number = 0;
    for (int i = 0; i < 8; ++i) number = number << 8 | std::uint8_t(bytes[std::size_t(i)]);
    return std::max<std::uint64_t>(number, 1);
}

std::uint64_t size_of(const Frames& frames) {
    return std::accumulate(frames.begin(), frames.end(), std::uint64_t{0},
                           [](std::uint64_t sum, const std::string& frame) { return sum + frame.size(); });
}

/// The classic detector looks every six seconds; the adaptive one needs beats.
TimeNs heartbeat_of(DetectorKind kind) {
    return kind == DetectorKind::fixed ? FixedDetectorParams{}.period
                                       : AdaptiveDetectorParams{}.expected_interval;
}

/// When a server may believe that its client is gone: late, since nothing is lost by waiting.
TimeNs dead_after_of(DetectorKind kind) {
    return kind == DetectorKind::fixed ? 20 * k_second_ns : 5 * k_second_ns;
}

}  // namespace

// ---- Beginning and end.

Result<std::unique_ptr<ClientSession>> ClientSession::create(const ClientConfig& config, ClientJob job,
                                                             EventStore& store) {
    Result<WakePair> wake = WakePair::create();
    if (!wake) return wake.error();
    std::unique_ptr<ClientSession> session(
        new ClientSession(config, std::move(job), store, std::move(*wake)));
    if (config.local_servers > 0 || config.listens)
        if (const auto opened = session->open_sockets(); !opened) return opened.error();
    if (const auto started = session->start_local_servers(); !started) return started.error();
    return session;
}

ClientSession::ClientSession(const ClientConfig& config, ClientJob job, EventStore& store, WakePair wake)
    : config_(config),
      job_(std::move(job)),
      store_(store),
      wake_(std::move(wake)),
      session_(random_session()),
      heartbeat_(heartbeat_of(config.detector)),
      work_({config.block_size, config.round_samples, config.schedule, config.order, config.sampling}, store),
      runner_(wake_, config.threads) {
    started_ = last_step_ = monotonic_now();
    store_.name_server(k_local_server, "client");
    job_.state.files = job_.depot.manifest_hash();
    packed_state_ = pack(encode_state(job_.state));
    state_hash_ = hash_text(packed_state_);
    work_.begin(job_.state.settings, Epoch{1}, started_);
    servers_changed();
}

ClientSession::~ClientSession() {
    for (const auto& [instance, server] : servers_) {
        const bool is_ours =
            std::any_of(local_servers_.begin(), local_servers_.end(),
                        [&](const LocalServer& local) { return local.is(server.pid, server.name); });
        send(Channel::monitor, instance,
             message::Bye{is_ours ? ByeReason::stop : ByeReason::leaving, "The frame is finished."});
    }
}

Result<void> ClientSession::open_sockets() {
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
        local_servers_.push_back({std::move(*process), name});
    }
    return {};
}

// ---- The loop.

void ClientSession::step(TimeNs max_wait) {
    TimeNs now = monotonic_now();
    const TimeNs wait = std::clamp<TimeNs>(next_timer(now) - now, 0, max_wait);
    std::vector<Pollable> pollables{wake_.pollable()};
    if (sockets_)
        pollables.insert(pollables.end(), {sockets_->monitor.pollable(), sockets_->frames.pollable(),
                                           sockets_->input.pollable()});
    const Readable ready = wait_readable(pollables, wait);
    now = monotonic_now();

    // If this process itself was stopped, silence proves nothing about the servers.
    if (now - last_step_ > k_own_pause + max_wait)
        for (auto& [instance, server] : servers_) server.detector.excuse(now - last_step_);
    last_step_ = now;

    if (ready[0]) wake_.clear();
    if (ready[1]) receive(sockets_->monitor, Channel::monitor);
    if (ready[2]) receive(sockets_->frames, Channel::frames);
    if (ready[3]) sockets_->input.count_subscriptions();
    for (RoundOutcome& outcome : runner_.take_finished()) on_outcome(outcome);

    now = monotonic_now();
    watch_door(now);
    watch_local_servers();
    watch_heartbeats(now);
    work_.indirect_ledger().expire(now);
    enforce_time_limit(now);
    hand_out(now);
}

TimeNs ClientSession::next_timer(TimeNs now) const {
    TimeNs next = now + k_second_ns;
    if (!local_servers_.empty()) next = std::min(next, now + k_child_watch);
    for (const auto& [instance, server] : servers_) next = std::min(next, server.next_ping);
    if (!servers_.empty()) next = std::min(next, now + heartbeat_ / 4);
    if (const auto deadline = work_.indirect_ledger().next_deadline()) next = std::min(next, *deadline);
    if (config_.time_limit > 0 && !stopped_) next = std::min(next, started_ + config_.time_limit);
    return std::max(next, now);
}

bool ClientSession::complete() const { return work_.complete(); }

void ClientSession::enforce_time_limit(TimeNs now) {
    if (config_.time_limit == 0 || stopped_ || now - started_ < config_.time_limit || !work_.has_image())
        return;
    stopped_ = true;
    work_.stop();
    runner_.cancel_all();
}

void ClientSession::change_state(RenderState state, std::shared_ptr<const Scene> scene) {
    const TimeNs now = monotonic_now();
    state.files = job_.depot.manifest_hash();
    CHECK(scene || same_scene(state, job_.state));
    const PackMap changes = state_changes(job_.state, state);
    job_.state = std::move(state);
    if (scene) job_.scene = std::move(scene);
    packed_state_ = pack(encode_state(job_.state));
    state_hash_ = hash_text(packed_state_);

    const Epoch epoch{work_.epoch().value + 1};
    runner_.cancel_all();
    work_.begin(job_.state.settings, epoch, now);
    servers_changed();
    if (!sockets_) return;
    Frames input = encode(message::Input{session_, epoch, ++sequence_, state_hash_, pack(changes)});
    store_.count_all({{Counter::messages_out, 1}, {Counter::bytes_out, size_of(input)}});
    sockets_->input.publish(std::move(input));
    for (auto& [instance, server] : servers_)
        if (server.credits.owed() > 0)
            send(Channel::frames, instance, message::Cancel{session_, epoch, {}}, server.peer.id());
}

// ---- Messages.

template <class Socket>
void ClientSession::receive(Socket& socket, Channel channel) {
    drain(socket, k_messages_per_turn,
          [&](RoutedMessage message) { receive_one(message.peer, std::move(message.frames), channel); });
}

void ClientSession::receive_one(const std::string& instance, Frames frames, Channel channel) {
    const auto found = servers_.find(instance);
    Server* server = found == servers_.end() ? nullptr : &found->second;
    const ServerId id = server ? server->peer.id() : k_local_server;
    const std::uint64_t bytes = size_of(frames);
    store_.count_all({{Counter::messages_in, 1}, {Counter::bytes_in, bytes}}, id);

    Decoded decoded = decode(std::move(frames), Role::client, channel);
    if (!decoded) {
        count_dropped(id, decoded.error().sentence, channel);
        return reject_undecodable(instance, decoded.error(), channel);
    }
    if (store_.keeps_events())
        store_.record({monotonic_now(), 0, k_local_server, 0,
                       MessageEvent{MessageWay::received, name_of(type_of(*decoded)), name_of(channel), id,
                                    bytes, LongText(to_text(*decoded))}});
    if (const auto* hello = std::get_if<message::Hello>(&*decoded)) return on_hello(instance, *hello);
    if (!server) {
        count_dropped(id, "It comes from a server that did not say HELLO.", channel);
        return ask_who(instance, monotonic_now());
    }
    if (type_of(*decoded) != MessageType::pong) server->detector.on_traffic(monotonic_now());
    if (server->peer.state() == PeerState::suspect) step_peer(*server, PeerCause::heard, "It spoke again.");
    std::visit([&](auto& message) { on(*server, message); }, *decoded);
}

void ClientSession::count_dropped(ServerId server, std::string_view sentence, Channel channel) {
    store_.count(Counter::bad_messages, 1, server);
    if (store_.keeps_events())
        store_.record({monotonic_now(), 0, k_local_server, 0,
                       MessageEvent{MessageWay::dropped, "", name_of(channel), server, 0, sentence}});
}

void ClientSession::reject_undecodable(const std::string& instance, const DecodeError& error,
                                       Channel channel) {
    if (channel != Channel::monitor) return;
    if (error.fault == DecodeFault::version)
        send(channel, instance,
             message::Reject{
                 RejectCode::version,
                 fmt::format("The client speaks protocol version {}, this server {}. Install the same "
                             "version on both machines.",
                             k_protocol_version, error.version),
                 0});
    else if (error.fault == DecodeFault::malformed && error.type == std::uint8_t(MessageType::hello))
        send(channel, instance, message::Reject{RejectCode::malformed, error.sentence, 0});
}

/// An unknown peer may be a server that was given up too early: it shall begin anew. At most once a second each.
void ClientSession::ask_who(const std::string& instance, TimeNs now) {
    std::erase_if(who_asked_, [now](const auto& asked) { return now - asked.second >= k_who_pause; });
    if (who_asked_.size() >= k_max_unknown_peers || who_asked_.contains(instance)) return;
    who_asked_.emplace(instance, now);
    send(Channel::monitor, instance, message::Who{});
}

void ClientSession::send(Channel channel, const std::string& instance, Message message, ServerId peer) {
    const bool keeps_events = store_.keeps_events();
    const std::string text = keeps_events ? to_text(message) : std::string();
    const MessageType type = type_of(message);
    Frames frames = encode(std::move(message));
    const std::uint64_t bytes = size_of(frames);
    RouterSocket& socket = channel == Channel::monitor ? sockets_->monitor : sockets_->frames;
    const bool left = socket.send(instance, std::move(frames)) == SendOutcome::delivered;
    if (left) store_.count_all({{Counter::messages_out, 1}, {Counter::bytes_out, bytes}}, peer);
    if (keeps_events)
        store_.record(
            {monotonic_now(), 0, k_local_server, 0,
             MessageEvent{left ? MessageWay::sent : MessageWay::dropped, name_of(type), name_of(channel),
                          peer, bytes,
                          LongText(left ? text : "The peer is not connected, or does not keep up.")}});
}

// ---- Joining.

std::optional<std::string> ClientSession::reason_to_reject(const std::string& instance,
                                                           const message::Hello& hello) const {
    if (hello.instance != instance) return "HELLO names another instance than its connection has.";
    if (hello.build != build_identity())
        return fmt::format(
            "The client is '{}', this server is '{}': their pixels could differ in the last bit. Run "
            "the same build on both machines.",
            build_identity(), hello.build);
    return std::nullopt;
}

void ClientSession::on_hello(const std::string& instance, const message::Hello& hello) {
    if (const auto reason = reason_to_reject(instance, hello)) {
        log_warning(fmt::format("Refused the server {}: {}", hello.name, *reason));
        return send(Channel::monitor, instance,
                    message::Reject{hello.instance == instance ? RejectCode::build : RejectCode::malformed,
                                    *reason, 0});
    }
    const TimeNs now = monotonic_now();
    auto found = servers_.find(instance);
    if (found != servers_.end()) {
        // It did not hear the WELCOME, or forgot its work: it starts over under the same id.
        Server& server = found->second;
        work_.indirect_ledger().revoke(server.peer.id(), now);
        server.credits.clear();
        step_peer(server, PeerCause::state_lost, "It said HELLO again.");
    } else {
        if (servers_.size() >= k_max_servers)
            return send(
                Channel::monitor, instance,
                message::Reject{RejectCode::full, "The client has as many servers as it can take.", 5000});
        const ServerId id{++last_server_};
        found = servers_
                    .emplace(instance, Server{instance, hello.name, hello.pid, Peer(id, now),
                                              FailureDetector(config_.detector, now)})
                    .first;
        found->second.next_ping = now;
        store_.name_server(id, hello.name);
        store_.count(Counter::servers_joined, 1, id);
        for (LocalServer& local : local_servers_)
            if (local.is(hello.pid, hello.name)) local.joined = true;
        step_peer(found->second, PeerCause::welcomed, fmt::format("{} said HELLO.", hello.name));
    }
    send(Channel::monitor, instance, welcome(found->second.peer.id()), found->second.peer.id());
    servers_changed();
}

message::Welcome ClientSession::welcome(ServerId id) const {
    message::Welcome welcome;
    welcome.session = session_;
    welcome.server = id;
    welcome.heartbeat_ms = std::uint32_t(heartbeat_ / k_millisecond_ns);
    welcome.dead_after_ms = std::uint32_t(dead_after_of(config_.detector) / k_millisecond_ns);
    welcome.credits = k_server_credits;
    welcome.epoch = work_.epoch();
    welcome.sequence = sequence_;
    welcome.state_hash = state_hash_;
    welcome.state = packed_state_;
    return welcome;
}

void ClientSession::on(Server& server, message::SnapshotRequest&) {
    send(Channel::monitor, server.instance,
         message::Snapshot{session_, work_.epoch(), sequence_, state_hash_, packed_state_}, server.peer.id());
}

void ClientSession::on(Server& server, message::ManifestRequest& message) {
    if (auto answer = job_.depot.answer(message))
        send(Channel::monitor, server.instance, std::move(*answer), server.peer.id());
}

void ClientSession::on(Server& server, message::PieceRequest& message) {
    if (auto answer = job_.depot.answer(message))
        send(Channel::monitor, server.instance, std::move(*answer), server.peer.id());
    else
        count_dropped(server.peer.id(), "PIECE_REQUEST: the scene has no such file.", Channel::monitor);
}

void ClientSession::on(Server& server, message::Ready& message) {
    if (message.session != session_ || message.epoch != work_.epoch() || message.state_hash != state_hash_)
        return;
    if (server.peer.state() == PeerState::syncing)
        step_peer(server, PeerCause::synced, "It holds state and scene.");
    servers_changed();
}

void ClientSession::on(Server& server, message::Credit& message) {
    if (message.session == session_) server.credits.set_limit(std::min(message.credits, k_server_credits));
}

void ClientSession::on(Server& server, message::Bye& message) {
    if (message.reason == ByeReason::draining) {
        step_peer(server, PeerCause::drain, message.text);
        return servers_changed();
    }
    lose(server.instance, message.reason == ByeReason::leaving ? PeerCause::left : PeerCause::lost,
         message.text);
}

// ---- Heartbeats.

void ClientSession::on(Server& server, message::Ping& message) {
    const TimeNs received = monotonic_now();
    send(Channel::monitor, server.instance,
         message::Pong{message.token, received, monotonic_now(), work_.indirect_ledger().rounds_committed(),
                       0},
         server.peer.id());
}

void ClientSession::on(Server& server, message::Pong& message) {
    const TimeNs now = monotonic_now();
    server.detector.on_heartbeat(now);
    const auto rtt = server.clock.add({TimeNs(message.token), message.received_ns, message.sent_ns, now});
    if (rtt) store_.add_latency(Latency::heartbeat, *rtt, server.peer.id());
}

void ClientSession::watch_heartbeats(TimeNs now) {
    std::vector<std::pair<std::string, std::string>> dead;
    for (auto& [instance, server] : servers_) {
        if (now >= server.next_ping) {
            send(Channel::monitor, instance,
                 message::Ping{std::uint64_t(now), sequence_, work_.indirect_ledger().rounds_committed(), 0},
                 server.peer.id());
            server.next_ping = now + heartbeat_;
        }
        const Suspicion suspicion = server.detector.assess(now);
        if (suspicion.state == Liveness::dead)
            dead.emplace_back(instance,
                              fmt::format("It has been silent for {:.2f} s.", to_seconds(suspicion.silence)));
        else if (suspicion.state == Liveness::suspect && server.peer.state() == PeerState::ready)
            step_peer(server, PeerCause::silent,
                      fmt::format("It has been silent for {:.2f} s.", to_seconds(suspicion.silence)));
        server.credits.write_off(now);
    }
    for (const auto& [instance, why] : dead) lose(instance, PeerCause::lost, why);
}

/// Who was turned away is counted; who was taken off the list is given up at once.
void ClientSession::watch_door(TimeNs now) {
    if (!door_) return;
    if (const std::uint64_t refused = door_->step(now, sockets_->input))
        store_.count(Counter::refused_peers, refused);
    for (RouterSocket* socket : {&sockets_->monitor, &sockets_->frames})
        for (const std::string& instance : socket->take_revoked())
            lose(instance, PeerCause::lost, "Its key was taken off the list.");
}

void ClientSession::watch_local_servers() {
    for (LocalServer& local : local_servers_) {
        const auto ending = local.ended ? std::nullopt : local.process.ending();
        if (!ending) continue;
        local.ended = true;
        const auto server = std::find_if(servers_.begin(), servers_.end(), [&](const auto& entry) {
            return local.is(entry.second.pid, entry.second.name);
        });
        const std::string why = fmt::format("Its process ended with {}.", *ending);
        if (server != servers_.end()) {
            lose(server->first, PeerCause::lost, why);
        } else if (!local.joined) {
            log_warning(fmt::format("The local server {} did not join: {}", local.name, why));
            servers_changed();
        }
    }
}

void ClientSession::step_peer(Server& server, PeerCause cause, std::string_view detail) {
    const PeerState before = server.peer.state();
    if (!server.peer.apply(cause, monotonic_now())) return;
    if (store_.keeps_events())
        store_.record(
            {monotonic_now(), 0, k_local_server, 0,
             StateEvent{"peer", server.peer.id(), name_of(before), name_of(server.peer.state()), detail}});
}

/// A server is gone; what it owed is open again. Its entry, and so `instance` if it is the entry's, ends here.
void ClientSession::lose(const std::string& instance, PeerCause cause, std::string_view why) {
    const auto found = servers_.find(instance);
    if (found == servers_.end()) return;
    Server& server = found->second;
    const ServerId id = server.peer.id();
    step_peer(server, cause, why);
    const std::size_t open = work_.indirect_ledger().revoke(id, monotonic_now()).size();
    if (cause == PeerCause::lost) store_.count(Counter::died, 1, id);
    log_note(fmt::format("{} {}: {} {} round{} of it go{} to others.", server.name,
                         cause == PeerCause::lost ? "is lost" : "left", why, open, open == 1 ? "" : "s",
                         open == 1 ? "es" : ""));
    servers_.erase(found);
    servers_changed();
}

// ---- Work.

int ClientSession::alive_servers() const {
    return int(std::count_if(servers_.begin(), servers_.end(), [](const auto& entry) {
        return entry.second.peer.alive() && entry.second.peer.state() != PeerState::draining;
    }));
}

bool ClientSession::expects_servers(TimeNs now) const {
    if (!reached_min_servers_ && config_.min_servers > 0) {
        const bool can_come = config_.listens || now - started_ < k_join_patience;
        if (can_come) return true;
    }
    return now - started_ < k_join_patience &&
           std::any_of(local_servers_.begin(), local_servers_.end(),
                       [](const LocalServer& local) { return !local.joined && !local.ended; });
}

bool ClientSession::renders_alone(TimeNs now) const { return alive_servers() == 0 && !expects_servers(now); }

/// Tells the schedule who may be given work.
void ClientSession::servers_changed() {
    std::vector<ServerShare> shares;
    int ready = 0;
    for (const auto& [instance, server] : servers_) {
        const PeerState state = server.peer.state();
        ready += state == PeerState::ready || state == PeerState::suspect;
        if (state == PeerState::ready || state == PeerState::suspect)
            shares.push_back({server.peer.id(), server.speed.per_second()});
    }
    reached_min_servers_ = reached_min_servers_ || ready >= std::max(1, config_.min_servers);
    if (renders_alone(monotonic_now())) shares.push_back({k_local_server, 0});
    std::sort(shares.begin(), shares.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
    work_.set_servers(std::move(shares));
}

void ClientSession::hand_out(TimeNs now) {
    if (stopped_) return;
    const bool alone = renders_alone(now);
    if (alone != announced_alone_) {
        announced_alone_ = alone;
        servers_changed();
        if (alone && last_server_ > 0 && !work_.complete())
            log_note("No server is left; the client carries on alone.");
    }
    if (config_.min_servers == 0 || reached_min_servers_)
        for (auto& [instance, server] : servers_) hand_out_to(server, now);
    hand_out_locally(now);
}

void ClientSession::hand_out_to(Server& server, TimeNs now) {
    while (server.peer.accepts_work() && server.credits.available() && grant_to(server, now)) {
    }
}

bool ClientSession::grant_to(Server& server, TimeNs now) {
    const ServerId id = server.peer.id();
    // What it owes comes first, so that counts into the time this round may take.
    const auto duration = [&](const Round& round, std::uint32_t attempts) {
        const double samples = double(round.samples()) * double(server.credits.owed() + 1);
        return lease_duration(server.speed.predict(samples), attempts);
    };
    std::optional<Lease> lease = work_.grant_indirect(id, now, duration);
    if (!lease && config_.schedule == ScheduleKind::pull && server.credits.owed() == 0) {
        // Nothing is open, but another server may be late with its last rounds.
        const double samples = double(config_.block_size) * config_.block_size * config_.round_samples;
        if (const auto estimate = server.speed.predict(samples))
            if (const auto straggler = pick_straggler(work_.indirect_ledger(), id, now, *estimate))
                lease = work_.indirect_ledger().grant_copy(id, *straggler, now, lease_duration(estimate, 1));
    }
    if (!lease) return false;
    send_lease(server, *lease, now);
    return true;
}

void ClientSession::send_lease(Server& server, const Lease& lease, TimeNs now) {
    const TimeNs duration = lease.deadline - now;
    server.credits.take(lease.id, lease.deadline + duration);
    message::Lease message;
    message.session = session_;
    message.lease = lease.id;
    message.epoch = lease.epoch;
    message.strategy = std::string(k_blocks_strategy);
    message.unit = lease.unit;
    message.rect = work_.round_of(lease).rect;
    message.first = lease.first;
    message.count = lease.count;
    message.lease_ms = std::uint32_t(std::clamp<TimeNs>(duration / k_millisecond_ns, 1, 3'600'000));
    send(Channel::frames, server.instance, std::move(message), server.peer.id());
}

/// The client's next own round. Alone it renders both parts, which then grow evenly: of one round together wherever it
/// can; else direct light is all there is to do.
std::optional<ClientSession::LocalWork> ClientSession::next_local_work(TimeNs now) {
    LocalWork work;
    const auto take_indirect = [&] {
        if (!announced_alone_) return;
        work.indirect = work_.grant_indirect(k_local_server, now, [](const Round&, std::uint32_t) {
            return TimeNs{1} << 61;  // No deadline: if the client is gone, so is the account.
        });
    };
    if (work_.indirect_progress() > work_.direct_progress()) work.direct = work_.grant_direct(now);
    if (!work.direct) take_indirect();
    if (work.indirect)
        work.direct = work_.grant_direct_beside(*work.indirect, now);
    else if (!work.direct)
        work.direct = work_.grant_direct(now);
    if (!work.direct && !work.indirect) return std::nullopt;
    return work;
}

void ClientSession::hand_out_locally(TimeNs now) {
    while (runner_.pending() < k_local_rounds) {
        const std::optional<LocalWork> work = next_local_work(now);
        if (!work) return;
        const std::uint64_t ticket = ++last_ticket_;
        const LightPart part = work->indirect ? LightPart::indirect : LightPart::direct;
        const bool direct_too = work->indirect && work->direct;
        const Round round = work_.round_of(work->indirect ? *work->indirect : *work->direct);
        local_work_.emplace(ticket, *work);
        runner_.begin({ticket, part, round, job_.scene, job_.state.camera, job_.state.settings, direct_too});
    }
}

void ClientSession::on_outcome(RoundOutcome& outcome) {
    const TimeNs now = monotonic_now();
    const LocalWork work = local_work_.extract(outcome.ticket).mapped();
    if (work.direct)
        settle(LightPart::direct, *work.direct, work.indirect ? outcome.direct : outcome.result, now);
    if (work.indirect) settle(LightPart::indirect, *work.indirect, outcome.result, now);
}

/// Books what the client's own renderer made of a lease.
void ClientSession::settle(LightPart part, const Lease& lease, const std::optional<RoundResult>& result,
                           TimeNs now) {
    if (!result) {  // Cancelled: its epoch ended, or the time limit was reached.
        if (part == LightPart::direct)
            work_.release_direct(lease, now);
        else
            work_.indirect_ledger().release(lease.id, k_local_server, now);
        return;
    }
    const ResultClaim claim{lease.id, lease.epoch, lease.unit, lease.first, lease.count, k_local_server};
    const Commit commit = work_.commit(part, claim, result->sums, now);
    if (commit.verdict == Verdict::accepted) count_result(*result, k_local_server);
    cancel_superseded(commit.superseded);
}

void ClientSession::on(Server& server, message::Tile& tile) {
    const TimeNs now = monotonic_now();
    const ServerId id = server.peer.id();
    server.credits.settle(tile.lease);
    const ResultClaim claim{
        tile.lease, tile.session == session_ ? tile.epoch : Epoch{}, tile.unit, tile.first, tile.count, id};
    // Decoded only if it counts, committed only if it decodes.
    if (work_.indirect_ledger().judge(claim) != Verdict::accepted) {
        work_.commit(LightPart::indirect, claim, {}, now);
        return;
    }
    const std::int64_t pixels = work_.rect_of(tile.unit).area();
    RoundResult result;
    result.rays = tile.rays;
    result.samples = std::uint64_t(pixels) * tile.count;
    result.dropped = tile.dropped;
    result.dropped_count = tile.dropped_count;
    result.saturated_count = tile.saturated_count;
    const TimeNs started = tile.started_ns, render_time = tile.render_ns;
    const LeaseId lease = tile.lease;
    Result<std::vector<PixelSum>> sums = block_result(std::move(tile), pixels);
    if (!sums) {
        work_.indirect_ledger().release(lease, id, now);
        return count_dropped(id, sums.error().message, Channel::frames);
    }

    const Commit commit = work_.commit(LightPart::indirect, claim, *sums, now);
    server.speed.add(double(result.samples), render_time);
    store_.add_latency(Latency::tile, commit.since_grant, id);
    count_result(result, id);
    if (const auto offset = server.clock.at(now); offset && store_.keeps_events())
        store_.record({offset->to_client(started), 0, id, 0, SpanEvent{"render", render_time, lease}});
    cancel_superseded(commit.superseded);
}

void ClientSession::on(Server& server, message::Nack& message) {
    const TimeNs now = monotonic_now();
    server.credits.settle(message.lease);
    if (message.session != session_ || message.epoch != work_.epoch()) return;
    work_.indirect_ledger().release(message.lease, server.peer.id(), now);
    if (message.code == NackCode::state || message.code == NackCode::scene) {
        step_peer(server, PeerCause::state_lost, name_of(message.code));
        return servers_changed();
    }
    if (message.code == NackCode::unsupported || message.code == NackCode::failed ||
        message.code == NackCode::memory)
        lose(server.instance, PeerCause::lost, fmt::format("It cannot do its work ({}).", message.text));
}

void ClientSession::count_result(const RoundResult& result, ServerId server) {
    store_.count_all({{Counter::tiles, 1},
                      {Counter::rays, result.rays},
                      {Counter::samples, result.samples},
                      {Counter::nonfinite_dropped, result.dropped_count}},
                     server);
    saturated_ += result.saturated_count;
    for (const DroppedSample& dropped : result.dropped)
        if (dropped_.size() < k_max_dropped_listed) dropped_.push_back(dropped);
}

void ClientSession::cancel_superseded(const std::vector<Lease>& leases) {
    for (const Lease& lease : leases)
        for (auto& [instance, server] : servers_)
            if (server.peer.id() == lease.server)
                send(Channel::frames, instance, message::Cancel{session_, lease.epoch, {lease.id.value}},
                     lease.server);
}

Progress ClientSession::progress() const {
    Progress progress;
    progress.direct = work_.direct_progress();
    progress.indirect = work_.indirect_progress();
    progress.servers_known = alive_servers();
    for (const auto& [instance, server] : servers_) progress.servers_ready += server.peer.accepts_work();
    progress.alone = announced_alone_;
    progress.waiting = config_.min_servers > 0 && !reached_min_servers_;
    return progress;
}

}  // namespace pathscope
