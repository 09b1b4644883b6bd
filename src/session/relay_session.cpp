#include "pathscope/session/relay_session.hpp"

#include <unistd.h>

#include <algorithm>

#include "pathscope/net/poller.hpp"
#include "pathscope/session/build_identity.hpp"
#include "pathscope/session/server_session.hpp"

namespace pathscope {
namespace {

constexpr TimeNs k_drain_limit = 10 * k_second_ns;
constexpr TimeNs k_longest_wait = k_second_ns;
constexpr TimeNs k_last_word_pause =
    50 * k_millisecond_ns;  ///< BYE must not overtake the last tile, which takes another connection.
constexpr TimeNs k_own_pause = 2 * k_second_ns;  ///< A step later than this after the last: we were stopped.

ServerIdentity identity_of(const RelayConfig& config) {
    return {config.client.name, std::string(program_version()), own_bits(), 1, std::uint32_t(::getpid()),
            config.client.host};
}

/// Reads each file once; its reader compares the hash.
Result<SceneDepot> depot_of(const Manifest& manifest, const SceneCache& cache) {
    ManifestFiles files(manifest, [&cache](const Digest& hash) { return cache.path_of(hash); });
    for (const ManifestEntry& entry : manifest.files)
        if (const auto bytes = files.read(entry.name); !bytes) return bytes.error();
    return SceneDepot(manifest, cache);
}

}  // namespace

Result<std::unique_ptr<RelaySession>> RelaySession::create(RelayConfig config) {
    (void)own_bits();  // Rendered before there is a heartbeat to be late for.
    Result<WakePair> wake = WakePair::create();
    if (!wake) return wake.error();
    if (config.client.name.empty()) config.client.name = default_server_name();
    config.below.listens = true;
    Context context;
    Result<ClientSockets> sockets = ClientSockets::open(context, config.below);
    if (!sockets) return sockets.error();
    return std::unique_ptr<RelaySession>(
        new RelaySession(std::move(config), context, std::move(*sockets), std::move(*wake)));
}

RelaySession::RelaySession(RelayConfig config, Context context, ClientSockets sockets, WakePair wake)
    : config_(std::move(config)),
      context_(std::move(context)),
      wake_(std::move(wake)),
      sockets_(std::move(sockets)),
      link_(context_, config_.client),
      cache_(config_.cache_folder),
      machine_(identity_of(config_), cache_, config_.below, random_session(), store_, *this),
      last_step_(monotonic_now()),
      checked_(wake_) {}

RelaySession::~RelaySession() = default;

void RelaySession::request_stop() noexcept {
    stop_requested_.store(true);
    wake_.notify();
}

Result<void> RelaySession::run() {
    while (!machine_.above().ended() && !stop_requested_.load() && !failure_) step();
    say_goodbye();
    if (failure_) return *failure_;
    if (machine_.above().refusal()) return *machine_.above().refusal();
    return {};
}

/// Dials when there is somebody to work for a client; then does what there is to do.
void RelaySession::step() {
    ServerMachine& above = machine_.above();
    TimeNs now = monotonic_now();
    if (!above.linked()) {
        link_.close();
        if (machine_.wants_client(now) && now >= link_.next_dial())
            if (const auto dialled = link_.dial(above); !dialled) failure_ = dialled.error();
    }
    std::vector<Pollable> pollables{wake_.pollable()};
    for (const Pollable& pollable : sockets_.pollables()) pollables.push_back(pollable);
    const std::size_t of_link = pollables.size();
    if (link_.open())
        for (const Pollable& pollable : link_.pollables()) pollables.push_back(pollable);
    TimeNs next = std::min(machine_.next_timer(now), now + k_longest_wait);
    if (!above.linked() && link_.next_dial() > now) next = std::min(next, link_.next_dial());
    const Readable ready = wait_readable(pollables, std::max<TimeNs>(next - now, 0));

    now = monotonic_now();
    if (now - last_step_ > k_own_pause) machine_.on_own_pause(now - last_step_);
    last_step_ = now;
    if (ready[0]) wake_.clear();
    sockets_.receive(ready, 1, machine_);
    if (link_.open()) link_.receive(ready, of_link, above);
    for (CheckedScene& checked : checked_.take_all()) machine_.on_checked(checked, monotonic_now());
    sockets_.watch_door(ready, 1, store_, machine_);
    machine_.on_timers(monotonic_now());
}

void RelaySession::check_scene(RenderState state, Manifest manifest) {
    reader_.post([this, state = std::move(state), manifest = std::move(manifest)] {
        checked_.put({state, depot_of(manifest, cache_)});
    });
}

void RelaySession::say_goodbye() {
    const TimeNs limit = monotonic_now() + k_drain_limit;
    if (!machine_.above().ended()) machine_.drain(monotonic_now());
    while (!machine_.above().ended() && machine_.above().linked() && !machine_.drained() &&
           monotonic_now() < limit)
        step();
    for (const TimeNs end = monotonic_now() + k_last_word_pause;
         machine_.above().linked() && !machine_.above().ended() && monotonic_now() < end;)
        step();
    machine_.say_goodbye(monotonic_now());
}

}  // namespace pathscope
