#include "pathscope/session/server_session.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "channel_options.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/core/parallel_for.hpp"
#include "pathscope/net/poller.hpp"
#include "pathscope/protocol/block_result.hpp"
#include "pathscope/session/build_identity.hpp"

namespace pathscope {
namespace {

constexpr TimeNs k_first_hello_pause = 250 * k_millisecond_ns;
constexpr TimeNs k_longest_hello_pause = 5 * k_second_ns;
constexpr TimeNs k_idle_wait = k_second_ns;  ///< Longest wait without a timer due.
constexpr TimeNs k_drain_limit = 10 * k_second_ns;
constexpr int k_messages_per_turn = 100;  ///< Per socket, so that none starves the others.
constexpr int k_max_fetch_failures = 3;

std::string endpoint(const ServerConfig& config, std::size_t channel) {
    return fmt::format("tcp://{}:{}", config.host, config.ports[channel]);
}

std::string default_name() {
    char host[65] = {};
    ::gethostname(host, sizeof host - 1);
    return fmt::format("{}-{}", host, ::getpid());
}

}  // namespace

Result<std::unique_ptr<ServerSession>> ServerSession::create(ServerConfig config) {
    Result<WakePair> wake = WakePair::create();
    if (!wake) return wake.error();
    if (config.name.empty()) config.name = default_name();
    if (config.threads == 0) config.threads = hardware_threads();
    return std::unique_ptr<ServerSession>(new ServerSession(std::move(config), std::move(*wake)));
}

ServerSession::ServerSession(ServerConfig config, WakePair wake)
    : config_(std::move(config)),
      wake_(std::move(wake)),
      cache_(config_.cache_folder),
      loaded_(wake_),
      runner_(wake_, config_.threads, config_.samples_per_second) {}

ServerSession::~ServerSession() = default;

void ServerSession::request_stop() noexcept {
    stop_requested_.store(true);
    wake_.notify();
}

Result<void> ServerSession::run() {
    while (!ended_ && !stop_requested_.load()) {
        if (!link_) {
            if (monotonic_now() < redial_.next()) {
                wait_to_dial();
                continue;
            }
            if (const auto dialled = dial(); !dialled) return dialled;
        }
        step();
    }
    if (refusal_) return *refusal_;
    if (link_) say_goodbye();
    return {};
}

// ---- The link.

/// After a refusal. Results that come meanwhile belong to a client that is gone; step() clears them away.
void ServerSession::wait_to_dial() {
    if (wait_readable({wake_.pollable()}, redial_.next() - monotonic_now())[0]) wake_.clear();
}

Result<void> ServerSession::dial() {
    const std::string instance = random_routing_id();
    // Input first: what is published after WELCOME was made must not be missed if it can be helped.
    auto input = SubscriberSocket::connect(context_, endpoint(config_, 0), std::string(k_input_topic),
                                           channel_options(Channel::input, config_.security));
    if (!input) return input.error();
    auto monitor = DealerSocket::connect_watched(context_, endpoint(config_, 1), instance,
                                                 channel_options(Channel::monitor, config_.security));
    if (!monitor) return monitor.error();
    auto frames = DealerSocket::connect(context_, endpoint(config_, 2), instance,
                                        channel_options(Channel::frames, config_.security));
    if (!frames) return frames.error();
    link_.emplace(Link{instance, std::move(*input), std::move(monitor->dealer), std::move(monitor->watch),
                       std::move(*frames)});
    phase_ = Phase::hello;
    hello_pause_ = k_first_hello_pause;
    next_hello_ = last_heard_ = monotonic_now();
    return {};
}

/// Refused at the door: it says so, and dials anew after a pause, as ZeroMQ does not.
void ServerSession::on_connection_changes() {
    for (const Refusal& refusal : link_->watch.take_changes().refusals) {
        const auto sentence =
            redial_.on_refused(refusal.reason, endpoint(config_, 1), config_.security, monotonic_now());
        if (sentence) log_warning(fmt::format("{}: {}", config_.name, *sentence));
        relink_ = true;
        relink_reason_.clear();
    }
}

/// Forgets everything about this client but the scene, which the next one may want as well.
void ServerSession::lose_link(std::string_view why) {
    if (!why.empty()) log_note(fmt::format("{}: {} Dialling {} again.", config_.name, why, config_.host));
    runner_.cancel_all();
    leases_.clear();
    unsent_answers_.clear();
    held_.reset();
    fetch_.reset();
    missed_since_.reset();
    snapshot_asked_.reset();
    session_ = 0;
    link_.reset();
}

void ServerSession::step() {
    const TimeNs now = monotonic_now();
    const Readable ready =
        wait_readable({wake_.pollable(), link_->monitor.pollable(), link_->frames.pollable(),
                       link_->input.pollable(), link_->watch.pollable()},
                      next_timer(now) - now);
    if (ready[0]) wake_.clear();
    if (ready[1]) receive(link_->monitor, Channel::monitor);
    if (ready[2]) receive(link_->frames, Channel::frames);
    if (ready[3]) receive(link_->input, Channel::input);
    if (ready[4]) on_connection_changes();
    for (LoadedScene& loaded : loaded_.take_all()) on_loaded(loaded);
    for (RoundOutcome& outcome : runner_.take_finished()) on_outcome(outcome);
    on_timers(monotonic_now());
    if (relink_ && !ended_) lose_link(relink_reason_);
    relink_ = false;
}

template <class Socket>
void ServerSession::receive(Socket& socket, Channel channel) {
    drain(socket, k_messages_per_turn, [&](Frames frames) {
        last_heard_ = monotonic_now();
        Decoded decoded = decode(std::move(frames), Role::server, channel);
        if (decoded) return std::visit([this](auto& message) { on(message); }, *decoded);
        if (decoded.error().fault == DecodeFault::version) {
            refusal_ =
                failed(fmt::format("The client at {} speaks protocol version {}; this server speaks {}. "
                                   "Install the same version on both machines.",
                                   config_.host, decoded.error().version, k_protocol_version));
            ended_ = true;
        } else {
            log_warning(fmt::format("{}: dropped a message from the client: {}", config_.name,
                                    decoded.error().sentence));
        }
    });
}

// ---- Timers.

TimeNs ServerSession::next_timer(TimeNs now) const {
    TimeNs next = now + k_idle_wait;
    if (phase_ == Phase::hello) {
        next = std::min(next, next_hello_);
    } else {
        next = std::min({next, next_ping_, last_heard_ + dead_after_});
        if (missed_since_) next = std::min(next, *missed_since_ + heartbeat_);
        if (!unsent_answers_.empty()) next = std::min(next, now + k_millisecond_ns);
    }
    return std::max(next, now);
}

void ServerSession::on_timers(TimeNs now) {
    if (!link_) return;
    if (phase_ == Phase::hello) {
        if (now < next_hello_) return;
        send_monitor(message::Hello{link_->instance, config_.name, program_version(), build_identity(),
                                    std::uint32_t(config_.threads), std::uint32_t(::getpid())});
        next_hello_ = now + hello_pause_;
        hello_pause_ = std::min(2 * hello_pause_, k_longest_hello_pause);
        return;
    }
    if (now - last_heard_ >= dead_after_) {
        relink_ = true;
        relink_reason_ =
            fmt::format("The client has been silent for {:.1f} s.", to_seconds(now - last_heard_));
        return;
    }
    if (now >= next_ping_) {
        send_monitor(message::Ping{std::uint64_t(now), held_ ? held_->sequence : 0, samples_done_,
                                   std::uint32_t(leases_.size())});
        next_ping_ = now + heartbeat_;
    }
    if (missed_since_ && now - *missed_since_ >= heartbeat_) ask_for_snapshot(now);
    if (fetch_) advance_scene(now);
    flush_answers();
}

// ---- Joining, and the state.

void ServerSession::on(message::Welcome& message) {
    if (session_ != 0 && session_ != message.session) return;
    redial_.on_welcome();
    session_ = message.session;
    credits_ = message.credits;
    heartbeat_ = TimeNs(message.heartbeat_ms) * k_millisecond_ns;
    dead_after_ = TimeNs(message.dead_after_ms) * k_millisecond_ns;
    if (phase_ == Phase::hello) {
        phase_ = Phase::sync;
        next_ping_ = monotonic_now();
        send_answer(message::Credit{session_, credits_});
    }
    take_state(message.state, message.epoch, message.sequence, message.state_hash);
}

void ServerSession::on(message::Reject& message) {
    if (phase_ != Phase::hello) return;
    if (message.retry_ms == 0) {
        refusal_ =
            failed(fmt::format("The client at {} refuses this server: {}", config_.host, message.text));
        ended_ = true;
        return;
    }
    log_note(fmt::format("{}: not admitted yet: {}", config_.name, message.text));
    next_hello_ = monotonic_now() + TimeNs(message.retry_ms) * k_millisecond_ns;
}

void ServerSession::on(message::Who&) {
    if (phase_ == Phase::hello) return;  // A HELLO is on its way.
    relink_ = true;
    relink_reason_ = "The client does not know this server any more.";
}

void ServerSession::on(message::Bye& message) {
    if (message.reason == ByeReason::stop) {
        ended_ = true;
        return;
    }
    relink_ = true;
    relink_reason_ = "The client has left.";
}

void ServerSession::on(message::Snapshot& message) {
    if (message.session == session_)
        take_state(message.state, message.epoch, message.sequence, message.state_hash);
}

void ServerSession::take_state(const std::string& bytes, Epoch epoch, std::uint64_t sequence,
                               const Digest& hash) {
    snapshot_asked_.reset();
    if (held_ && sequence < held_->sequence) return;
    if (hash_text(bytes) != hash) {
        log_warning(fmt::format("{}: a render state arrived damaged.", config_.name));
        return;
    }
    const Result<PackValue> value = unpack(bytes, k_payload_limits);
    const PackMap* map = value ? value->get<PackMap>() : nullptr;
    Result<RenderState> state = map ? decode_state(*map) : bad_input("The render state is not a map.");
    if (state) return hold({std::move(*state), epoch, sequence, hash});

    // Another version's levers: this server would render another image.
    send_monitor(message::Bye{ByeReason::error, state.error().message});
    refusal_ = failed(fmt::format("Cannot follow the client at {}: {}", config_.host, state.error().message));
    ended_ = true;
}

void ServerSession::on(message::Input& message) {
    if (message.session != session_ || !held_ || message.sequence <= held_->sequence) return;
    const Result<PackValue> value = unpack(message.changes, k_payload_limits);
    const PackMap* changes = value ? value->get<PackMap>() : nullptr;
    if (message.sequence == held_->sequence + 1 && changes) {
        Result<RenderState> state = apply_changes(held_->state, *changes);
        if (state && state_hash(*state) == message.state_hash)
            return hold({std::move(*state), message.epoch, message.sequence, message.state_hash});
    }
    ask_for_snapshot(monotonic_now());
}

void ServerSession::ask_for_snapshot(TimeNs now) {
    missed_since_.reset();
    if (snapshot_asked_ && now - *snapshot_asked_ < heartbeat_) return;
    if (send_monitor(message::SnapshotRequest{session_, held_ ? held_->sequence : 0})) snapshot_asked_ = now;
}

/// Takes over a new state: work of other epochs ends, and the scene follows if it is another one.
void ServerSession::hold(HeldState held) {
    missed_since_.reset();
    held_ = std::move(held);
    for (const auto& [ticket, lease] : leases_)
        if (lease.epoch != held_->epoch) runner_.cancel(ticket);
    if (scene_ && same_scene(*scene_state_, held_->state)) return become_ready();
    phase_ = Phase::sync;
    fetch_.emplace(cache_, held_->state.files);
    fetch_failures_ = 0;
    advance_scene(monotonic_now());
}

void ServerSession::become_ready() {
    fetch_.reset();
    phase_ = Phase::work;
    send_monitor(message::Ready{session_, held_->epoch, held_->sequence, held_->hash});
}

// ---- The scene.

void ServerSession::on(message::Manifest& message) {
    if (!fetch_) return;
    if (const auto taken = fetch_->on_manifest(message); !taken) return scene_failed(taken.error());
    advance_scene(monotonic_now());
}

void ServerSession::on(message::Piece& message) {
    if (!fetch_) return;
    if (const auto taken = fetch_->on_piece(std::move(message)); !taken) return scene_failed(taken.error());
    advance_scene(monotonic_now());
}

void ServerSession::advance_scene(TimeNs now) {
    if (fetch_->complete()) {
        if (!loading_) begin_loading();
        return;
    }
    for (Message& request : fetch_->requests(now)) send_monitor(std::move(request));
}

void ServerSession::begin_loading() {
    loading_ = true;
    loader_.post([this, state = held_->state, manifest = fetch_->manifest()] {
        ManifestFiles files(manifest, [this](const Digest& hash) { return cache_.path_of(hash); });
        Result<SceneParts> parts = load_scene_parts(state.scene, files, state.options, config_.mesh_cache);
        if (!parts) return loaded_.put({state, parts.error()});
        Result<Scene> scene = make_scene(state.scene, std::move(*parts), {config_.threads, config_.tree});
        if (!scene) return loaded_.put({state, scene.error()});
        loaded_.put({state, std::shared_ptr<const Scene>(std::make_shared<Scene>(std::move(*scene)))});
    });
}

void ServerSession::on_loaded(LoadedScene& loaded) {
    loading_ = false;
    if (loaded.scene) {
        scene_ = std::move(*loaded.scene);
        scene_state_ = std::move(loaded.state);
    }
    if (!held_ || !fetch_) return;  // The client was lost, or already has what it wants.
    if (!same_scene(loaded.state, held_->state) && !(scene_ && same_scene(*scene_state_, held_->state)))
        return advance_scene(monotonic_now());  // It wants another one by now.
    if (scene_ && same_scene(*scene_state_, held_->state)) return become_ready();

    // Perhaps a file of the cache is damaged: fetch all of them anew.
    for (const ManifestEntry& entry : fetch_->manifest().files) cache_.forget(entry.hash);
    scene_failed(loaded.scene.error());
}

void ServerSession::scene_failed(const Error& error) {
    log_warning(fmt::format("{}: {}", config_.name, error.message));
    if (++fetch_failures_ < k_max_fetch_failures) {
        fetch_.emplace(cache_, held_->state.files);
        return advance_scene(monotonic_now());
    }
    send_monitor(message::Bye{ByeReason::error, error.message});
    refusal_ = failed(fmt::format("Cannot load the client's scene: {}", error.message));
    ended_ = true;
}

// ---- Work.

void ServerSession::on(message::Lease& lease) {
    if (lease.session != session_ || !held_ || holds_lease(lease.lease)) return;
    if (draining_) return refuse(lease, NackCode::draining);
    if (leases_.size() >= credits_) return refuse(lease, NackCode::busy);
    if (lease.epoch != held_->epoch) {
        if (lease.epoch > held_->epoch) ask_for_snapshot(monotonic_now());
        return refuse(lease, NackCode::state);
    }
    if (phase_ != Phase::work) return refuse(lease, NackCode::scene);
    const RenderSettings& settings = held_->state.settings;
    const PixelRect frame{0, 0, settings.width, settings.height};
    if (lease.strategy != k_blocks_strategy || !frame.contains(lease.rect) ||
        lease.count > k_max_samples_per_pixel || lease.first > k_max_samples_per_pixel - lease.count ||
        lease.rect.width > k_max_block_size || lease.rect.height > k_max_block_size)
        return refuse(lease, NackCode::unsupported, "This server renders blocks inside the frame.");

    const Round round{lease.unit, lease.rect, lease.first, lease.count};
    const std::uint64_t ticket = ++last_ticket_;
    runner_.begin({ticket, LightPart::indirect, round, scene_, held_->state.camera, settings});
    leases_.emplace(ticket, std::move(lease));
}

bool ServerSession::holds_lease(LeaseId number) const {
    return std::any_of(leases_.begin(), leases_.end(),
                       [number](const auto& entry) { return entry.second.lease == number; });
}

void ServerSession::on(message::Cancel& message) {
    if (message.session != session_) return;
    const auto unwanted = [&](const message::Lease& lease) {
        return lease.epoch != message.epoch || std::find(message.leases.begin(), message.leases.end(),
                                                         lease.lease.value) != message.leases.end();
    };
    for (const auto& [ticket, lease] : leases_)
        if (unwanted(lease)) runner_.cancel(ticket);
}

void ServerSession::on_outcome(RoundOutcome& outcome) {
    const auto found = leases_.find(outcome.ticket);
    if (found == leases_.end()) return;  // Of a client that was lost.
    const message::Lease lease = std::move(found->second);
    leases_.erase(found);
    if (!outcome.result)
        return outcome.failure.empty() ? refuse(lease, draining_ ? NackCode::draining : NackCode::cancelled)
                                       : refuse(lease, NackCode::failed, outcome.failure);
    const RoundResult& result = *outcome.result;
    samples_done_ += result.samples;

    message::Tile tile;
    tile.session = session_;
    tile.lease = lease.lease;
    tile.epoch = lease.epoch;
    tile.strategy = lease.strategy;
    tile.unit = lease.unit;
    tile.first = lease.first;
    tile.count = lease.count;
    tile.rays = result.rays;
    tile.samples = result.samples;
    tile.started_ns = outcome.started;
    tile.render_ns = outcome.duration;
    tile.dropped = result.dropped;
    tile.dropped_count = std::uint32_t(result.dropped_count);
    tile.saturated_count = std::uint32_t(result.saturated_count);
    put_block_result(tile, result.sums);
    send_answer(std::move(tile));
}

void ServerSession::refuse(const message::Lease& lease, NackCode code, std::string text) {
    send_answer(message::Nack{session_, lease.lease, lease.epoch, code, std::move(text)});
}

void ServerSession::on(message::Ping& message) {
    const TimeNs received = monotonic_now();
    if (held_ && message.sequence > held_->sequence && !missed_since_) missed_since_ = received;
    send_monitor(message::Pong{message.token, received, monotonic_now(), samples_done_,
                               std::uint32_t(leases_.size())});
}

// ---- Sending.

/// Whether it left. What is lost here is repeated by a timer: HELLO, requests, heartbeats.
bool ServerSession::send_monitor(Message message) {
    return link_->monitor.send(encode(std::move(message))) == SendOutcome::delivered;
}

/// An answer must not be lost: it waits until the socket takes it.
void ServerSession::send_answer(Message message) {
    unsent_answers_.push_back(std::move(message));
    flush_answers();
}

void ServerSession::flush_answers() {
    while (!unsent_answers_.empty()) {
        Frames frames = encode(unsent_answers_.front());
        if (link_->frames.send(std::move(frames)) != SendOutcome::delivered) return;
        unsent_answers_.pop_front();
    }
}

/// Gives back what was not begun, lets the round in work finish, and leaves.
void ServerSession::say_goodbye() {
    if (phase_ == Phase::work) {
        draining_ = true;
        send_monitor(message::Bye{ByeReason::draining, "The server was asked to stop."});
        if (!leases_.empty())
            for (auto lease = std::next(leases_.begin()); lease != leases_.end(); ++lease)
                runner_.cancel(lease->first);
        const TimeNs limit = monotonic_now() + k_drain_limit;
        while (!ended_ && link_ && !relink_ && (!leases_.empty() || !unsent_answers_.empty()) &&
               monotonic_now() < limit)
            step();
        if (!link_) return;
    }
    if (phase_ != Phase::hello)
        send_monitor(message::Bye{ByeReason::leaving, "The server was asked to stop."});
}

}  // namespace pathscope
