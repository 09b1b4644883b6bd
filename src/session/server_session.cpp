#include "pathscope/session/server_session.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include "pathscope/core/log.hpp"
#include "pathscope/core/parallel_for.hpp"
#include "pathscope/net/poller.hpp"
#include "pathscope/session/build_identity.hpp"

namespace pathscope {
namespace {

constexpr TimeNs k_drain_limit = 10 * k_second_ns;

ServerIdentity identity_of(const ServerConfig& config) {
    return {config.name,
            std::string(program_version()),
            config.claimed_bits ? *config.claimed_bits : own_bits(),
            std::uint32_t(config.threads),
            std::uint32_t(::getpid()),
            config.host};
}

}  // namespace

std::string default_server_name() {
    char host[65] = {};
    ::gethostname(host, sizeof host - 1);
    return fmt::format("{}-{}", host, ::getpid());
}

Result<std::unique_ptr<ServerSession>> ServerSession::create(ServerConfig config) {
    Result<WakePair> wake = WakePair::create();
    if (!wake) return wake.error();
    if (config.name.empty()) config.name = default_server_name();
    if (config.threads == 0) config.threads = hardware_threads();
    return std::unique_ptr<ServerSession>(new ServerSession(std::move(config), std::move(*wake)));
}

ServerSession::ServerSession(ServerConfig config, WakePair wake)
    : config_(std::move(config)),
      wake_(std::move(wake)),
      link_(context_, {config_.host, config_.ports, config_.security, config_.name}),
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
            link_.close();
            if (monotonic_now() < link_.next_dial()) {
                wait_to_dial();
                continue;
            }
            if (const auto dialled = link_.dial(machine_); !dialled) return dialled;
        }
        step();
    }
    if (machine_.refusal()) return *machine_.refusal();
    if (machine_.linked()) say_goodbye();
    return {};
}

/// After a refusal. Results that come meanwhile belong to a client that is gone; step() clears them away.
void ServerSession::wait_to_dial() {
    if (wait_readable({wake_.pollable()}, link_.next_dial() - monotonic_now())[0]) wake_.clear();
}

void ServerSession::step() {
    const TimeNs now = monotonic_now();
    const auto link = link_.pollables();
    const Readable ready =
        wait_readable({wake_.pollable(), link[0], link[1], link[2], link[3]}, machine_.next_timer(now) - now);
    if (ready[0]) wake_.clear();
    link_.receive(ready, 1, machine_);
    for (LoadedScene& loaded : loaded_.take_all()) machine_.on_loaded(loaded, monotonic_now());
    for (RoundOutcome& outcome : runner_.take_finished()) machine_.on_outcome(outcome, monotonic_now());
    machine_.on_timers(monotonic_now());
}

bool ServerSession::send(Channel channel, Frames&& frames) { return link_.send(channel, std::move(frames)); }

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
