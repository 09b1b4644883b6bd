#pragma once
/// A render server among real sockets and threads: it feeds the state machine (server_machine.hpp) with what happens, and
/// does what the machine asks.
///
/// Two threads: the one that calls run() owns the sockets and answers heartbeats at once; a worker loads scenes and
/// renders rounds. So heavy work never looks like death.
/// Thread safety: request_stop() from any thread and from signal handlers; all else from one thread.
/// Test: tests/session/test_cluster.cpp

#include <array>
#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "pathscope/net/context.hpp"
#include "pathscope/net/wake_pair.hpp"
#include "pathscope/session/client_config.hpp"
#include "pathscope/session/server_link.hpp"
#include "pathscope/session/server_machine.hpp"
#include "pathscope/session/worker.hpp"

namespace pathscope {

struct ServerConfig {
    std::string host = "127.0.0.1";  ///< Of the client.
    std::array<int, 3> ports = k_default_ports;
    Security security;  ///< A Dialler, or none.
    std::string name;   ///< For people; empty = host name and process id.
    int threads = 0;    ///< 0 = all cores.
    TreeKind tree = TreeKind::wide;
    double samples_per_second = 0;  ///< Speed cap; 0 = none.
    std::filesystem::path cache_folder;
    std::optional<BitsIdentity> claimed_bits;  ///< What HELLO says in place of the truth: for tests.
    std::function<void()> before_round;        ///< On the thread that renders: for tests, where it may block.
    std::optional<MeshCache> mesh_cache;
};

/// Of a server that was given no name: host name and process id.
[[nodiscard]] std::string default_server_name();

class ServerSession : private ServerWorld {
  public:
    [[nodiscard]] static Result<std::unique_ptr<ServerSession>> create(ServerConfig config);
    ~ServerSession() override;

    /// Serves one client after the other. Returns when asked to stop, by request_stop() or the client; an error if the
    /// client refused this server for good.
    [[nodiscard]] Result<void> run();

    /// Finishes the round in work, gives the others back, says goodbye. Async-signal-safe.
    void request_stop() noexcept;

  private:
    explicit ServerSession(ServerConfig config, WakePair wake);
    void wait_to_dial();
    void step();
    void say_goodbye();

    // The world, as the machine sees it.
    bool send(Channel channel, Frames&& frames) override;
    void begin(RoundJob job) override { runner_.begin(std::move(job)); }
    void cancel(std::uint64_t ticket) override { runner_.cancel(ticket); }
    void cancel_all() override { runner_.cancel_all(); }
    [[nodiscard]] std::uint64_t work_done() const override { return runner_.work_done(); }
    void load(RenderState state, Manifest manifest) override;

    ServerConfig config_;
    Context context_;
    WakePair wake_;
    std::atomic<bool> stop_requested_{false};
    ServerLink link_;
    SceneCache cache_;
    ServerMachine machine_;
    Mailbox<LoadedScene> loaded_;
    RoundRunner runner_;
    Worker loader_;  // Last, so that it ends first.
};

}  // namespace pathscope
