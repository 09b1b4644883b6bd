#pragma once
/// The client of a frame: admits servers, keeps them up to date, hands out rounds, merges what comes back, and
/// renders direct light itself meanwhile. docs/protocol.md, section 6.2.
///
///     auto session = ClientSession::create(config, job, store);
///     while (!(*session)->complete()) (*session)->step(limit);
///
/// With no server alive, and none on its way, indirect rounds go to the client's own renderer, so the image is finished
/// whatever dies. Every step of every server is in the event store, with its reason.
/// Thread safety: one thread calls everything but request_wake(); rendering happens on a thread inside.
/// Test: tests/session/test_cluster.cpp

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pathscope/cluster/clock_offset.hpp"
#include "pathscope/cluster/lease_policy.hpp"
#include "pathscope/cluster/peer.hpp"
#include "pathscope/net/context.hpp"
#include "pathscope/net/publisher.hpp"
#include "pathscope/net/router.hpp"
#include "pathscope/probe/event_store.hpp"
#include "pathscope/protocol/codec.hpp"
#include "pathscope/session/child_process.hpp"
#include "pathscope/session/client_config.hpp"
#include "pathscope/session/door.hpp"
#include "pathscope/session/frame_work.hpp"
#include "pathscope/session/render_state.hpp"
#include "pathscope/session/round_runner.hpp"
#include "pathscope/session/scene_depot.hpp"

namespace pathscope {

/// What to render.
struct ClientJob {
    RenderState state;
    std::shared_ptr<const Scene> scene;  ///< Of state.scene, files and options.
    SceneDepot depot;                    ///< Of the same files.
};

/// What people watch.
struct Progress {
    double direct = 0, indirect = 0;  ///< 0 to 1
    int servers_ready = 0;
    int servers_known = 0;  ///< Ready, or on their way to be.
    bool waiting = false;   ///< Indirect light waits for servers.
    bool alone = false;     ///< The client renders indirect light itself.
};

class ClientSession {
  public:
    /// Opens the sockets, if any are asked for, and starts the local servers. `store` outlives the session.
    [[nodiscard]] static Result<std::unique_ptr<ClientSession>> create(const ClientConfig& config,
                                                                       ClientJob job, EventStore& store);
    ~ClientSession();  ///< Tells the servers goodbye; local ones end.

    /// Does what there is to do, waiting `max_wait` at most for something to happen.
    void step(TimeNs max_wait);

    /// Nothing is left to wait for: the image is finished, or the time limit was reached and every block has samples.
    [[nodiscard]] bool complete() const;

    /// A new camera, size, lever or scene: the epoch rises, servers are told, the frame begins anew. The scene must be
    /// given too when the state is of another one.
    void change_state(RenderState state, std::shared_ptr<const Scene> scene = nullptr);

    /// Wakes step() up, from any thread or signal handler.
    void request_wake() noexcept { wake_.notify(); }

    [[nodiscard]] Progress progress() const;
    [[nodiscard]] const FrameWork& work() const { return work_; }
    [[nodiscard]] const RenderState& state() const { return job_.state; }
    [[nodiscard]] Epoch epoch() const { return work_.epoch(); }
    [[nodiscard]] std::uint64_t saturated() const { return saturated_; }
    [[nodiscard]] const std::vector<DroppedSample>& dropped() const { return dropped_; }
    [[nodiscard]] const std::array<std::string, 3>& endpoints() const {
        return endpoints_;
    }  ///< Empty without sockets.

  private:
    struct Sockets {
        PublisherSocket input;
        RouterSocket monitor;
        RouterSocket frames;
    };
    struct Server {
        std::string instance;
        std::string name;
        std::uint32_t pid = 0;
        Peer peer;
        FailureDetector detector;
        ClockEstimate clock{};
        Credits credits{0};
        SpeedEstimate speed{};
        TimeNs next_ping = 0;
    };
    /// A round of the client's own renderer: one part of it, or both.
    struct LocalWork {
        std::optional<Lease> direct, indirect;
    };
    struct LocalServer {
        ChildProcess process;
        std::string name;
        bool joined = false;
        bool ended = false;

        /// Process ids repeat from machine to machine: the name must be ours as well.
        [[nodiscard]] bool is(std::uint32_t pid, std::string_view other_name) const {
            return pid == std::uint32_t(process.pid()) && name == other_name;
        }
    };

    ClientSession(const ClientConfig& config, ClientJob job, EventStore& store, WakePair wake);
    Result<void> open_sockets();
    Result<void> start_local_servers();

    // Messages.
    template <class Socket>
    void receive(Socket& socket, Channel channel);
    void receive_one(const std::string& instance, Frames frames, Channel channel);
    void reject_undecodable(const std::string& instance, const DecodeError& error, Channel channel);
    void on_hello(const std::string& instance, const message::Hello& hello);
    void on(Server& server, message::SnapshotRequest& message);
    void on(Server& server, message::ManifestRequest& message);
    void on(Server& server, message::PieceRequest& message);
    void on(Server& server, message::Ready& message);
    void on(Server& server, message::Ping& message);
    void on(Server& server, message::Pong& message);
    void on(Server& server, message::Bye& message);
    void on(Server& server, message::Credit& message);
    void on(Server& server, message::Tile& message);
    void on(Server& server, message::Nack& message);
    template <class Other>
    void on(Server&, Other&) {}  // HELLO is handled before; the rest never decodes for a client.
    void send(Channel channel, const std::string& instance, Message message, ServerId peer = k_local_server);
    void count_dropped(ServerId server, std::string_view sentence, Channel channel);
    void ask_who(const std::string& instance, TimeNs now);
    [[nodiscard]] message::Welcome welcome(ServerId id) const;

    // Servers.
    [[nodiscard]] std::optional<std::string> reason_to_reject(const std::string& instance,
                                                              const message::Hello& hello) const;
    void step_peer(Server& server, PeerCause cause, std::string_view detail);
    void lose(const std::string& instance, PeerCause cause, std::string_view why);
    void watch_door(TimeNs now);
    void watch_local_servers();
    void watch_heartbeats(TimeNs now);
    void servers_changed();

    // Work.
    void hand_out(TimeNs now);
    void hand_out_to(Server& server, TimeNs now);
    bool grant_to(Server& server, TimeNs now);
    void send_lease(Server& server, const Lease& lease, TimeNs now);
    [[nodiscard]] std::optional<LocalWork> next_local_work(TimeNs now);
    void hand_out_locally(TimeNs now);
    void cancel_superseded(const std::vector<Lease>& leases);
    void on_outcome(RoundOutcome& outcome);
    void settle(LightPart part, const Lease& lease, const std::optional<RoundResult>& result, TimeNs now);
    void count_result(const RoundResult& result, ServerId server);
    void enforce_time_limit(TimeNs now);

    [[nodiscard]] bool expects_servers(TimeNs now) const;
    [[nodiscard]] bool renders_alone(TimeNs now) const;
    [[nodiscard]] int alive_servers() const;
    [[nodiscard]] TimeNs next_timer(TimeNs now) const;

    ClientConfig config_;
    ClientJob job_;
    EventStore& store_;
    Context context_;
    WakePair wake_;
    std::optional<Door> door_;
    std::optional<Sockets> sockets_;
    std::array<std::string, 3> endpoints_;

    std::uint64_t session_ = 0;   ///< Random; tells this run from an earlier one.
    std::uint64_t sequence_ = 0;  ///< Of the last INPUT.
    std::string packed_state_;
    Digest state_hash_{};

    std::map<std::string, Server> servers_;  ///< By instance; those that live.
    std::vector<LocalServer> local_servers_;
    std::uint32_t last_server_ = 0;
    bool reached_min_servers_ = false;
    bool announced_alone_ = false;
    std::map<std::string, TimeNs> who_asked_;  ///< Unknown peers, bounded.

    TimeNs started_ = 0;
    TimeNs last_step_ = 0;
    TimeNs heartbeat_ = 0;
    FrameWork work_;
    std::uint64_t last_ticket_ = 0;
    std::map<std::uint64_t, LocalWork> local_work_;  ///< In the runner, by ticket.
    std::uint64_t saturated_ = 0;
    std::vector<DroppedSample> dropped_;  ///< The first k_max_dropped_listed.
    bool stopped_ = false;

    RoundRunner runner_;  // Last, so that it ends first.
};

}  // namespace pathscope
