#pragma once
/// The client among real sockets, processes and threads: it feeds the state machine (client_machine.hpp) with what happens,
/// and does what the machine asks.
///
///     auto session = ClientSession::create(config, job, store);
///     while (!(*session)->complete()) (*session)->step(limit);
///
/// Thread safety: one thread calls everything but request_wake(); rendering happens on a thread inside.
/// Test: tests/session/test_cluster.cpp

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pathscope/net/context.hpp"
#include "pathscope/session/child_process.hpp"
#include "pathscope/session/client_machine.hpp"
#include "pathscope/session/client_sockets.hpp"

namespace pathscope {

class ClientSession : private ClientWorld {
  public:
    /// Opens the sockets, if any are asked for, and starts the local servers. `store` outlives the session.
    [[nodiscard]] static Result<std::unique_ptr<ClientSession>> create(const ClientConfig& config,
                                                                       ClientJob job, EventStore& store);
    ~ClientSession() override;  ///< Tells the servers goodbye; local ones end.

    /// Does what there is to do, waiting `max_wait` at most for something to happen.
    void step(TimeNs max_wait);

    /// As those of the machine.
    [[nodiscard]] bool complete() const { return machine_.complete(); }
    void change_state(RenderState state, std::shared_ptr<const Scene> scene = nullptr) {
        machine_.change_state(std::move(state), std::move(scene), monotonic_now());
    }
    [[nodiscard]] Progress progress() const { return machine_.progress(); }
    [[nodiscard]] ClusterFigures figures() const { return machine_.figures(); }
    [[nodiscard]] const FrameWork& work() const { return machine_.work(); }
    [[nodiscard]] const RenderState& state() const { return machine_.state(); }
    [[nodiscard]] Epoch epoch() const { return machine_.epoch(); }
    [[nodiscard]] std::uint64_t saturated() const { return machine_.saturated(); }
    [[nodiscard]] std::uint64_t differing_rounds() const { return machine_.differing_rounds(); }
    [[nodiscard]] const std::vector<DroppedSample>& dropped() const { return machine_.dropped(); }

    /// Wakes step() up, from any thread or signal handler.
    void request_wake() noexcept { wake_.notify(); }

    [[nodiscard]] const std::array<std::string, 3>& endpoints() const {
        return endpoints_;
    }  ///< Empty without sockets.

  private:
    struct LocalServer {
        ChildProcess process;
        std::string name;
        bool ended = false;
    };

    ClientSession(const ClientConfig& config, ClientJob job, EventStore& store, WakePair wake);
    Result<void> open_sockets();
    Result<void> start_local_servers();
    void watch_local_servers();

    // The world, as the machine sees it.
    bool send(Channel channel, const std::string& instance, Frames frames) override;
    void publish(Frames frames) override;
    void begin(RoundJob job) override { runner_.begin(std::move(job)); }
    void cancel_all() override { runner_.cancel_all(); }

    ClientConfig config_;
    EventStore& store_;
    Context context_;
    WakePair wake_;
    std::optional<ClientSockets> sockets_;
    std::array<std::string, 3> endpoints_;
    std::vector<LocalServer> local_servers_;
    RoundRunner runner_;
    ClientMachine machine_;
    TimeNs last_step_;
};

}  // namespace pathscope
