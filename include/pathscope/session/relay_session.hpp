#pragma once
/// A relay among real sockets and threads: it feeds the state machine (relay_machine.hpp) with what happens, and does what
/// the machine asks.
///
/// Two threads: the one that calls run() owns all sockets, those to the client and those to the servers; a worker reads the
/// scene's files in the cache, to see whether they are whole.
/// Thread safety: request_stop() from any thread and from signal handlers; all else from one thread.
/// Test: tests/session/test_relay.cpp, tests/system/test_relay.py

#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "pathscope/net/context.hpp"
#include "pathscope/net/wake_pair.hpp"
#include "pathscope/probe/event_store.hpp"
#include "pathscope/session/client_config.hpp"
#include "pathscope/session/client_sockets.hpp"
#include "pathscope/session/relay_machine.hpp"
#include "pathscope/session/server_link.hpp"
#include "pathscope/session/worker.hpp"

namespace pathscope {

struct RelayConfig {
    ClientAddress client{"127.0.0.1", k_default_ports, {}, {}};  ///< An empty name: host name and process id.
    std::filesystem::path cache_folder;
    ClientConfig
        below;  ///< Where it listens, with which keys, and its failure detector; the rest means nothing here.
};

class RelaySession : private RelayWorld {
  public:
    /// Opens the sockets for servers.
    [[nodiscard]] static Result<std::unique_ptr<RelaySession>> create(RelayConfig config);
    ~RelaySession() override;

    /// Stands between one client after the other and its servers. Returns when asked to stop, by request_stop() or the
    /// client; an error if the client refused this relay for good.
    [[nodiscard]] Result<void> run();

    /// Finishes what its servers have begun, gives the rest back, says goodbye on both sides. Async-signal-safe.
    void request_stop() noexcept;

    [[nodiscard]] const RelayMachine& machine() const { return machine_; }
    [[nodiscard]] const EventStore& store() const { return store_; }
    /// Where servers dial: input, monitor, frames.
    [[nodiscard]] std::array<std::string, 3> endpoints() const { return sockets_.endpoints(); }

  private:
    RelaySession(RelayConfig config, Context context, ClientSockets sockets, WakePair wake);
    void step();
    void say_goodbye();

    // The world, as the machine sees it.
    bool send_up(Channel channel, Frames&& frames) override { return link_.send(channel, std::move(frames)); }
    bool send_down(Channel channel, const std::string& instance, Frames frames) override {
        return sockets_.send(channel, instance, std::move(frames));
    }
    void publish_down(Frames frames) override { sockets_.publish(std::move(frames)); }
    void check_scene(RenderState state, Manifest manifest) override;

    RelayConfig config_;
    EventStore store_;
    Context context_;
    WakePair wake_;
    std::atomic<bool> stop_requested_{false};
    ClientSockets sockets_;
    ServerLink link_;
    std::optional<Error> failure_;  ///< The client's address is none.
    SceneCache cache_;
    RelayMachine machine_;
    TimeNs last_step_;
    Mailbox<CheckedScene> checked_;
    Worker reader_;  // Last, so that it ends first.
};

}  // namespace pathscope
