#include "pathscope/session/server_session.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include "channel_options.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/core/parallel_for.hpp"
#include "pathscope/net/poller.hpp"
#include "pathscope/session/build_identity.hpp"

namespace pathscope {
namespace {

constexpr TimeNs k_drain_limit = 10 * k_second_ns;
constexpr int k_messages_per_turn = 100;  ///< Per socket, so that none starves the others.

std::string endpoint(const ServerConfig& config, std::size_t channel) {
    return fmt::format("tcp://{}:{}", config.host, config.ports[channel]);
}

std::string default_name() {
    char host[65] = {};
    ::gethostname(host, sizeof host - 1);
    return fmt::format("{}-{}", host, ::getpid());
}

ServerIdentity identity_of(const ServerConfig& config) {
    return {config.name,
            std::string(program_version()),
            config.claimed_bits ? *config.claimed_bits : own_bits(),
            std::uint32_t(config.threads),
            std::uint32_t(::getpid()),
            config.host};
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
      machine_(identity_of(config_), cache_, *this),
      loaded_(wake_),
      runner_(wake_, config_.threads, config_.samples_per_second, config_.before_round) {}

ServerSession::~ServerSession() = default;

void ServerSession::request_stop() noexcept {
    stop_requested_.store(true);
    wake_.notify();
}

Result<void> ServerSession::run() {
    while (!machine_.ended() && !stop_requested_.load()) {
        if (!machine_.linked()) {
            link_.reset();
            if (monotonic_now() < redial_.next()) {
                wait_to_dial();
                continue;
            }
            if (const auto dialled = dial(); !dialled) return dialled;
        }
        step();
    }
    if (machine_.refusal()) return *machine_.refusal();
    if (machine_.linked()) say_goodbye();
    return {};
}

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
    link_.emplace(
        Link{std::move(*input), std::move(monitor->dealer), std::move(monitor->watch), std::move(*frames)});
    machine_.on_linked(instance, monotonic_now());
    return {};
}

void ServerSession::step() {
    const TimeNs now = monotonic_now();
    const Readable ready =
        wait_readable({wake_.pollable(), link_->monitor.pollable(), link_->frames.pollable(),
                       link_->input.pollable(), link_->watch.pollable()},
                      machine_.next_timer(now) - now);
    if (ready[0]) wake_.clear();
    if (ready[1]) receive(link_->monitor, Channel::monitor);
    if (ready[2]) receive(link_->frames, Channel::frames);
    if (ready[3]) receive(link_->input, Channel::input);
    if (ready[4]) on_connection_changes();
    if (machine_.welcomed()) redial_.on_welcome();
    for (LoadedScene& loaded : loaded_.take_all()) machine_.on_loaded(loaded, monotonic_now());
    for (RoundOutcome& outcome : runner_.take_finished()) machine_.on_outcome(outcome, monotonic_now());
    machine_.on_timers(monotonic_now());
}

/// Refused at the door: it says so, and dials anew after a pause, as ZeroMQ does not.
void ServerSession::on_connection_changes() {
    const ConnectionChanges changes = link_->watch.take_changes();
    if (changes.lost > 0) machine_.on_connection_lost(monotonic_now());
    for (const Refusal& refusal : changes.refusals) {
        const auto sentence =
            redial_.on_refused(refusal.reason, endpoint(config_, 1), config_.security, monotonic_now());
        if (sentence) log_warning(fmt::format("{}: {}", config_.name, *sentence));
        machine_.on_refused(monotonic_now());
    }
}

template <class Socket>
void ServerSession::receive(Socket& socket, Channel channel) {
    drain(socket, k_messages_per_turn,
          [&](Frames frames) { machine_.on_message(std::move(frames), channel, monotonic_now()); });
}

bool ServerSession::send(Channel channel, Frames&& frames) {
    DealerSocket& socket = channel == Channel::monitor ? link_->monitor : link_->frames;
    return socket.send(std::move(frames)) == SendOutcome::delivered;
}

void ServerSession::load(RenderState state, Manifest manifest) {
    loader_.post([this, state = std::move(state), manifest = std::move(manifest)] {
        ManifestFiles files(manifest, [this](const Digest& hash) { return cache_.path_of(hash); });
        Result<SceneParts> parts = load_scene_parts(state.scene, files, state.options, config_.mesh_cache);
        if (!parts) return loaded_.put({state, parts.error()});
        Result<Scene> scene = make_scene(state.scene, std::move(*parts), {config_.threads, config_.tree});
        if (!scene) return loaded_.put({state, scene.error()});
        loaded_.put({state, std::shared_ptr<const Scene>(std::make_shared<Scene>(std::move(*scene)))});
    });
}

void ServerSession::say_goodbye() {
    const TimeNs limit = monotonic_now() + k_drain_limit;
    machine_.drain(monotonic_now());
    while (!machine_.ended() && machine_.linked() && !machine_.drained() && monotonic_now() < limit) step();
    if (machine_.linked()) machine_.say_goodbye(monotonic_now());
}

}  // namespace pathscope
