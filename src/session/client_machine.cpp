#include "pathscope/session/client_machine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "pathscope/core/log.hpp"

namespace pathscope {
namespace {

constexpr TimeNs k_answer_pause = k_second_ns;
constexpr std::size_t k_max_answered = 256;

std::uint64_t size_of(const Frames& frames) {
    return std::accumulate(frames.begin(), frames.end(), std::uint64_t{0},
                           [](std::uint64_t sum, const std::string& frame) { return sum + frame.size(); });
}

/// Nothing, if it is no fault of the sender: another version is told so. Damage is what its line or its memory does.
std::optional<Offence> offence_of(DecodeFault fault) {
    switch (fault) {
        case DecodeFault::foreign:
            return Offence::foreign;
        case DecodeFault::version:
            return std::nullopt;
        case DecodeFault::unknown_type:
            return Offence::unknown_type;
        case DecodeFault::misplaced:
            return Offence::misplaced;
        default:
            return Offence::malformed;
    }
}

/// The classic detector looks every six seconds; the adaptive one needs beats.
TimeNs heartbeat_of(DetectorKind kind) {
    return kind == DetectorKind::fixed ? FixedDetectorParams{}.period
                                       : AdaptiveDetectorParams{}.expected_interval;
}

}  // namespace

ClientMachine::ClientMachine(const ClientConfig& config, ClientJob job, std::uint64_t session,
                             EventStore& store, ClientWorld& world, TimeNs now, IndirectWork* relayed)
    : config_(config),
      strategy_(config.strategy),
      job_(std::move(job)),
      store_(store),
      world_(world),
      now_(now),
      started_(now),
      heartbeat_(heartbeat_of(config.detector)),
      session_(session),
      conduct_(config.conduct),
      audit_(config.audit),
      work_({config.block_size, config.round_samples, config.schedule, config.order, config.sampling,
             config.audit.share > 0},
            store),
      indirect_(relayed ? *relayed : work_),
      relays_(relayed != nullptr) {
    store_.name_server(k_local_server, "client");
    job_.state.files = job_.depot.manifest_hash();
    packed_state_ = pack(encode_state(job_.state));
    state_hash_ = hash_text(packed_state_);
    work_.begin(own_frame(), Epoch{1}, now_);
    servers_changed();
}

Result<void> ClientMachine::resume(const CheckpointFile& file) {
    if (config_.strategy != Strategy::blocks)
        return bad_input(
            fmt::format("A checkpoint is of the strategy 'blocks', not '{}'.", name_of(config_.strategy)));
    if (const auto taken = take_up(file, job_.state, work_, store_); !taken) return taken;
    saturated_ = file.history().saturated;
    dropped_ = file.history().dropped;
    differing_rounds_ = file.history().differing_rounds;
    return {};
}

/// That of a relay is empty.
RenderSettings ClientMachine::own_frame() const {
    RenderSettings settings = job_.state.settings;
    if (relays_) {
        settings.width = settings.height = 1;
        settings.spp = settings.direct_spp = 0;
    }
    return settings;
}

// ---- Time.

void ClientMachine::on_timers(TimeNs now) {
    now_ = now;
    if (probes_left_ > 0 && now_ >= next_probe_) probe_connections();
    if (now_ >= next_look_) watch_heartbeats();
    indirect_.expire(now_);
    audit_.expire(now_);
    enforce_time_limit();
    hand_out();
}

TimeNs ClientMachine::next_timer(TimeNs now) const {
    TimeNs next = now + k_second_ns;
    if (probes_left_ > 0) next = std::min(next, next_probe_);
    if (!servers_.empty()) next = std::min(next, next_look_);
    if (const auto deadline = indirect_.next_deadline()) next = std::min(next, *deadline);
    if (const auto deadline = audit_.next_deadline()) next = std::min(next, *deadline);
    // After that time, what is missing for a picture is waited for like anything else.
    if (const TimeNs end = started_ + config_.time_limit; config_.time_limit > 0 && now < end)
        next = std::min(next, end);
    return std::max(next, now);
}

void ClientMachine::enforce_time_limit() {
    if (config_.time_limit == 0 || stopped_ || now_ - started_ < config_.time_limit) return;
    audit_.stop();
    if (!work_.has_image() || !audit_.settled()) return;
    stopped_ = true;
    work_.stop();
    world_.cancel_all();
}

void ClientMachine::on_own_pause(TimeNs pause) {
    for (auto& [instance, server] : servers_) server.detector.excuse(pause);
}

// ---- The state.

void ClientMachine::change_state(RenderState state, std::shared_ptr<const Scene> scene, TimeNs now) {
    now_ = now;
    state.files = job_.depot.manifest_hash();
    CHECK(scene || same_scene(state, job_.state));
    const PackMap changes = state_changes(job_.state, state);
    job_.state = std::move(state);
    if (scene) job_.scene = std::move(scene);
    packed_state_ = pack(encode_state(job_.state));
    state_hash_ = hash_text(packed_state_);

    begin_epoch(changes, false);
}

/// All rounds of the epoch before end, here and everywhere.
void ClientMachine::begin_epoch(const PackMap& changes, bool same_frame) {
    const Epoch epoch{work_.epoch().value + 1};
    world_.cancel_all();
    same_frame ? work_.begin_anew(own_frame(), epoch, now_) : work_.begin(own_frame(), epoch, now_);
    if (!same_frame) differing_rounds_ = 0;  // Those of a checkpoint stay.
    audit_.begin();
    gave_direct_.clear();
    gave_indirect_.clear();
    std::erase_if(authors_, [this](const auto& author) { return !server_by_id_.contains(author.first); });
    servers_changed();
    Frames input = encode(message::Input{session_, epoch, ++sequence_, state_hash_, pack(changes)});
    store_.count_all({{Counter::messages_out, 1}, {Counter::bytes_out, size_of(input)}});
    world_.publish(std::move(input));
    for (auto& [instance, server] : servers_)
        if (server.credits.owed() > 0)
            send(Channel::frames, instance, message::Cancel{session_, epoch, {}}, server.peer.id());
}

// ---- Messages.

void ClientMachine::on_message(const std::string& instance, Frames frames, Channel channel, TimeNs now,
                               const Sender& sender) {
    now_ = now;
    const auto found = servers_.find(instance);
    Server* server = found == servers_.end() ? nullptr : &found->second;
    const ServerId id = server ? server->peer.id() : k_local_server;
    const std::uint64_t bytes = size_of(frames);
    store_.count_all({{Counter::messages_in, 1}, {Counter::bytes_in, bytes}}, id);
    const std::string who = server ? server->who : conduct_name(sender.key, "", sender.address);
    if (!(server ? server->allowance.allow(now_) : conduct_.may_send(who, now_))) {
        count_dropped(id, "It sends more messages than anyone needs.", channel);
        if (const auto ban = conduct_.report_flood(who, now_)) shut_out(who, *ban);
        return;
    }

    Decoded decoded = decode(std::move(frames), Role::client, channel);
    if (!decoded) {
        count_dropped(id, decoded.error().sentence, channel);
        reject_undecodable(instance, decoded.error(), channel);
        if (const auto offence = offence_of(decoded.error().fault)) offend(who, *offence);
        return;
    }
    if (store_.keeps_events())
        record(MessageEvent{MessageWay::received, name_of(type_of(*decoded)), name_of(channel), id, bytes,
                            LongText(to_text(*decoded))});
    if (const auto* hello = std::get_if<message::Hello>(&*decoded)) return on_hello(instance, *hello, sender);
    if (!server) {
        count_dropped(id, "It comes from a server that did not say HELLO.", channel);
        if (!conduct_.ban_of(who, now_)) ask_who(instance);
        return;
    }
    if (type_of(*decoded) != MessageType::pong) server->detector.on_traffic(now_);
    if (server->peer.state() == PeerState::suspect) step_peer(*server, PeerCause::heard, "It spoke again.");
    if (!std::exchange(server->asks, true)) asking_.push_back(server);
    std::visit([&](auto& message) { on(*server, message); }, *decoded);
}

void ClientMachine::record(EventBody body) { store_.record({now_, 0, k_local_server, 0, std::move(body)}); }

void ClientMachine::count_dropped(ServerId server, std::string_view sentence, Channel channel) {
    store_.count(Counter::bad_messages, 1, server);
    if (store_.keeps_events())
        record(MessageEvent{MessageWay::dropped, "", name_of(channel), server, 0, sentence});
}

void ClientMachine::reject_undecodable(const std::string& instance, const DecodeError& error,
                                       Channel channel) {
    if (channel != Channel::monitor) return;
    if (error.fault == DecodeFault::version && may_answer(instance))
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

/// Who is no server is answered at most once a second, and not more than so many of them: who knocks cannot make the client
/// talk as fast as it likes.
bool ClientMachine::may_answer(const std::string& stranger) {
    std::erase_if(answered_, [this](const auto& last) { return now_ - last.second >= k_answer_pause; });
    return answered_.size() < k_max_answered && answered_.emplace(stranger, now_).second;
}

/// An unknown peer may be a server that was given up too early: it shall begin anew.
bool ClientMachine::ask_who(const std::string& instance) {
    if (!may_answer(instance)) return false;
    send(Channel::monitor, instance, message::Who{});
    return true;
}

bool ClientMachine::send(Channel channel, const std::string& instance, Message message, ServerId peer) {
    const bool keeps_events = store_.keeps_events();
    const std::string text = keeps_events ? to_text(message) : std::string();
    const MessageType type = type_of(message);
    Frames frames = encode(std::move(message));
    const std::uint64_t bytes = size_of(frames);
    const bool left = world_.send(channel, instance, std::move(frames));
    if (left) store_.count_all({{Counter::messages_out, 1}, {Counter::bytes_out, bytes}}, peer);
    if (keeps_events)
        record(MessageEvent{left ? MessageWay::sent : MessageWay::dropped, name_of(type), name_of(channel),
                            peer, bytes,
                            LongText(left ? text : "The peer is not connected, or does not keep up.")});
    return left;
}

// ---- Local servers, and the end.

void ClientMachine::expect_server(std::uint32_t pid, std::string name) {
    local_servers_.push_back({pid, std::move(name)});
}

void ClientMachine::on_process_ended(std::uint32_t pid, std::string_view name, std::string_view how,
                                     TimeNs now) {
    now_ = now;
    const auto local = std::find_if(local_servers_.begin(), local_servers_.end(),
                                    [&](const LocalServer& one) { return one.is(pid, name); });
    CHECK(local != local_servers_.end(), pid, name);
    local->ended = true;
    const auto server = std::find_if(servers_.begin(), servers_.end(), [&](const auto& entry) {
        return local->is(entry.second.pid, entry.second.name);
    });
    const std::string why = fmt::format("Its process ended with {}.", how);
    if (server != servers_.end()) {
        lose(server->first, PeerCause::lost, why);
    } else if (!local->joined) {
        log_warning(fmt::format("The local server {} did not join: {}", local->name, why));
        servers_changed();
    }
}

void ClientMachine::on_revoked(const std::string& instance, std::string_view why, TimeNs now) {
    now_ = now;
    lose(instance, PeerCause::lost, why);
}

void ClientMachine::say_goodbye(TimeNs now) {
    now_ = now;
    for (const auto& [instance, server] : servers_) {
        const auto is_it = [&it = server](const LocalServer& local) { return local.is(it.pid, it.name); };
        const bool is_ours = std::any_of(local_servers_.begin(), local_servers_.end(), is_it);
        send(Channel::monitor, instance,
             message::Bye{is_ours ? ByeReason::stop : ByeReason::leaving, "The frame is finished."});
    }
}

}  // namespace pathscope
