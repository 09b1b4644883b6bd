#pragma once
/// A render server from its first HELLO to its last BYE: docs/protocol.md, section 6.1.
///
///     DIAL -> HELLO -> SYNC (state, scene) -> WORK (leases) -> ... ; a lost client leads back to DIAL
///
/// Two threads: the one that calls run() owns the sockets and answers heartbeats at once; a worker loads scenes and
/// renders rounds. So heavy work never looks like death.
/// What it holds is only what the client said last: the state with its sequence number, and the scene's files by hash.
/// Thread safety: request_stop() from any thread and from signal handlers; all else from one thread.
/// Test: tests/session/test_cluster.cpp

#include <array>
#include <atomic>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "pathscope/core/clock.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/net/context.hpp"
#include "pathscope/net/dealer.hpp"
#include "pathscope/net/subscriber.hpp"
#include "pathscope/net/wake_pair.hpp"
#include "pathscope/protocol/codec.hpp"
#include "pathscope/session/client_config.hpp"
#include "pathscope/session/refusal.hpp"
#include "pathscope/session/render_state.hpp"
#include "pathscope/session/round_runner.hpp"
#include "pathscope/session/scene_cache.hpp"
#include "pathscope/session/scene_fetch.hpp"
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
    std::optional<MeshCache> mesh_cache;
};

class ServerSession {
  public:
    [[nodiscard]] static Result<std::unique_ptr<ServerSession>> create(ServerConfig config);
    ~ServerSession();

    /// Serves one client after the other. Returns when asked to stop, by request_stop() or the client; an error if the
    /// client refused this server for good.
    [[nodiscard]] Result<void> run();

    /// Finishes the round in work, gives the others back, says goodbye. Async-signal-safe.
    void request_stop() noexcept;

  private:
    enum class Phase { hello, sync, work };

    struct Link {
        std::string instance;
        SubscriberSocket input;
        DealerSocket monitor;
        ConnectionWatch watch;  ///< Of monitor; the others share its fate.
        DealerSocket frames;
    };
    struct LoadedScene {
        RenderState state;  ///< What it was loaded for.
        Result<std::shared_ptr<const Scene>> scene;
    };
    /// The state as the client numbers it.
    struct HeldState {
        RenderState state;
        Epoch epoch;
        std::uint64_t sequence = 0;
        Digest hash{};
    };

    explicit ServerSession(ServerConfig config, WakePair wake);

    void wait_to_dial();
    Result<void> dial();
    void on_connection_changes();
    void lose_link(std::string_view why);
    void step();
    [[nodiscard]] TimeNs next_timer(TimeNs now) const;
    void on_timers(TimeNs now);

    template <class Socket>
    void receive(Socket& socket, Channel channel);
    void on(message::Welcome& message);
    void on(message::Reject& message);
    void on(message::Who& message);
    void on(message::Snapshot& message);
    void on(message::Manifest& message);
    void on(message::Piece& message);
    void on(message::Ping& message);
    void on(message::Bye& message);
    void on(message::Input& message);
    void on(message::Lease& message);
    void on(message::Cancel& message);
    template <class Other>
    void on(Other&) {}  // Known, but of no use to a server: PONG, and what only clients receive.

    void take_state(const std::string& bytes, Epoch epoch, std::uint64_t sequence, const Digest& hash);
    void hold(HeldState held);
    void ask_for_snapshot(TimeNs now);
    void advance_scene(TimeNs now);
    void begin_loading();
    void on_loaded(LoadedScene& loaded);
    void scene_failed(const Error& error);
    void become_ready();

    void on_outcome(RoundOutcome& outcome);
    [[nodiscard]] bool holds_lease(LeaseId lease) const;
    void refuse(const message::Lease& lease, NackCode code, std::string text = {});
    bool send_monitor(Message message);
    void send_answer(Message message);
    void flush_answers();
    void say_goodbye();

    ServerConfig config_;
    Context context_;
    WakePair wake_;
    std::atomic<bool> stop_requested_{false};
    bool ended_ = false;  ///< The client said stop, or refused us for good.
    std::optional<Error> refusal_;

    Redial redial_;
    std::optional<Link> link_;
    Phase phase_ = Phase::hello;
    bool draining_ = false;
    bool relink_ = false;  ///< Drop the link once the messages at hand are handled.
    std::string relink_reason_;

    // What the client told.
    std::uint64_t session_ = 0;
    std::uint32_t credits_ = 0;
    TimeNs heartbeat_ = 250 * k_millisecond_ns;
    TimeNs dead_after_ = 2 * k_second_ns;
    std::optional<HeldState> held_;

    // Timers.
    TimeNs last_heard_ = 0;
    TimeNs next_hello_ = 0;
    TimeNs hello_pause_ = 0;
    TimeNs next_ping_ = 0;
    std::optional<TimeNs> missed_since_;  ///< A PING told of an INPUT that has not come.
    std::optional<TimeNs> snapshot_asked_;

    // The scene, and the work on it.
    SceneCache cache_;
    std::optional<SceneFetch> fetch_;
    int fetch_failures_ = 0;
    bool loading_ = false;
    std::optional<RenderState> scene_state_;  ///< What scene_ was loaded for.
    std::shared_ptr<const Scene> scene_;
    std::map<std::uint64_t, message::Lease> leases_;  ///< Those in the runner, by its ticket.
    std::uint64_t last_ticket_ = 0;  ///< Lease numbers repeat from client to client, tickets do not.
    std::deque<Message>
        unsent_answers_;  ///< TILE and NACK that the socket would not take yet; bounded by credits.
    std::uint64_t samples_done_ = 0;

    Mailbox<LoadedScene> loaded_;
    RoundRunner runner_;
    Worker loader_;  // Last, so that it ends first.
};

}  // namespace pathscope
