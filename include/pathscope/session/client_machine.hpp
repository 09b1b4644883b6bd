#pragma once
/// The client of a frame as a state machine: admits servers, keeps them up to date, hands out rounds, merges what comes
/// back, and renders direct light itself meanwhile. docs/protocol.md, section 6.2.
///
///     something happened, at a time  ->  on_...(what, now)  ->  calls of the ClientWorld: messages, rounds of its own
///
/// Why no socket, no clock, no thread: the same machine runs against real sockets (client_session.hpp) and against a network
/// that delays, doubles, drops and cuts in virtual time (tests/session/simulated_cluster.hpp), thousands of times a minute.
/// With no server alive, and none on its way, indirect rounds go to the client's own renderer, so the image is finished
/// whatever dies. Every step of every server is in the event store, with its reason.
/// Requires: `now` never falls.
/// Thread safety: one thread at a time.   Test: tests/session/test_simulation.cpp, test_cluster.cpp

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pathscope/cluster/audit.hpp"
#include "pathscope/cluster/clock_offset.hpp"
#include "pathscope/cluster/conduct.hpp"
#include "pathscope/cluster/contributions.hpp"
#include "pathscope/cluster/figures.hpp"
#include "pathscope/cluster/lease_policy.hpp"
#include "pathscope/cluster/peer.hpp"
#include "pathscope/cluster/progress_watch.hpp"
#include "pathscope/probe/event_store.hpp"
#include "pathscope/protocol/codec.hpp"
#include "pathscope/session/admission.hpp"
#include "pathscope/session/checkpoint.hpp"
#include "pathscope/session/client_config.hpp"
#include "pathscope/session/frame_work.hpp"
#include "pathscope/session/render_state.hpp"
#include "pathscope/session/round_runner.hpp"
#include "pathscope/session/scene_depot.hpp"

namespace pathscope {

/// What to render.
struct ClientJob {
    RenderState state;
    std::shared_ptr<const Scene> scene;                   ///< Of state.scene, files and options.
    SceneDepot depot;                                     ///< Of the same files.
    std::optional<CheckpointFile> resume = std::nullopt;  ///< Go on from there.
};

/// What people watch.
struct Progress {
    double direct = 0, indirect = 0;  ///< 0 to 1
    int servers_ready = 0;
    int servers_known = 0;  ///< Ready, or on their way to be.
    bool waiting = false;   ///< Indirect light waits for servers.
    bool alone = false;     ///< The client renders indirect light itself.
};

/// What the machine does to the world.
class ClientWorld {
  public:
    virtual ~ClientWorld() = default;

    /// To one server. False if it is not connected or does not keep up; then the message is gone.
    virtual bool send(Channel channel, const std::string& instance, Frames frames) = 0;

    /// To all servers, on the input channel; may be lost on its way to any of them.
    virtual void publish(Frames frames) = 0;

    /// Begins a round of the client's own renderer. Each has one outcome: on_outcome().
    virtual void begin(RoundJob job) = 0;
    virtual void cancel_all() = 0;
};

class ClientMachine {
  public:
    /// session: random, not 0; tells this run from an earlier one. `store`, `world` and `relayed` outlive the machine.
    /// relayed: what servers are given, in place of a frame; then this machine renders nothing itself (relay_machine.hpp).
    ClientMachine(const ClientConfig& config, ClientJob job, std::uint64_t session, EventStore& store,
                  ClientWorld& world, TimeNs now, IndirectWork* relayed = nullptr);

    /// Takes up a checkpoint; an error if it is of other work. Requires: nothing has happened yet.
    [[nodiscard]] Result<void> resume(const CheckpointFile& file);

    // -- What happens ---------------------------------------------------------------------------------------

    /// A local server was started; the frame waits for it a while.
    void expect_server(std::uint32_t pid, std::string name);
    void on_process_ended(std::uint32_t pid, std::string_view name, std::string_view how, TimeNs now);
    void on_message(const std::string& instance, Frames frames, Channel channel, TimeNs now,
                    const Sender& sender = {});
    void on_outcome(RoundOutcome& outcome, TimeNs now);

    /// Some connection ended; whose is not known. A process that died is unreachable then, and is given up at once: but not
    /// with the detector `fixed`, which is that of the classic system.
    void on_connection_lost(TimeNs now);

    /// A server may take part no longer.
    void on_revoked(const std::string& instance, std::string_view why, TimeNs now);

    /// This process itself did not run for so long: that silence proves nothing about servers.
    void on_own_pause(TimeNs pause);

    /// Does what is due: heartbeats, judging silence, expired leases, handing out. To be called after everything else that
    /// happened, and at next_timer().
    void on_timers(TimeNs now);
    [[nodiscard]] TimeNs next_timer(TimeNs now) const;

    /// A new camera, size, lever or scene: the epoch rises, servers are told, the frame begins anew. The scene must be
    /// given too when the state is of another one.
    void change_state(RenderState state, std::shared_ptr<const Scene> scene, TimeNs now);

    /// The end of the session: local servers shall end, others shall look for the next client.
    void say_goodbye(TimeNs now);

    // -- For a relay: client_relayed.cpp --------------------------------------------------------------------

    /// As change_state(), where the scene's files may be others.
    void change_scene(RenderState state, std::shared_ptr<const Scene> scene, SceneDepot depot, TimeNs now);
    /// What leases ask for from here on. Who is admitted does not depend on it.
    void set_strategy(Strategy strategy) { strategy_ = strategy; }
    /// Leases whose results nobody wants any more.
    void withdraw(const std::vector<Lease>& leases);
    /// How many leases the servers could hold, all together.
    [[nodiscard]] std::size_t leases_wanted() const;
    /// Servers that may be given work and hold this state.
    [[nodiscard]] int servers_in_step() const;
    /// Rises while servers work, as far as they told.
    [[nodiscard]] std::uint64_t work_seen() const { return work_seen_; }

    // -- View -----------------------------------------------------------------------------------------------

    /// Nothing is left to wait for: the image is finished, or the time limit was reached and every block has samples.
    /// And no audit is open.
    [[nodiscard]] bool complete() const { return work_.complete() && (stopped_ || audit_.settled()); }
    [[nodiscard]] Progress progress() const;
    [[nodiscard]] ClusterFigures figures() const;  ///< client_figures.cpp
    [[nodiscard]] const FrameWork& work() const { return work_; }
    [[nodiscard]] const RenderState& state() const { return job_.state; }
    [[nodiscard]] Epoch epoch() const { return work_.epoch(); }
    [[nodiscard]] std::uint64_t saturated() const { return saturated_; }
    /// Rounds of the frame that came from servers of other bits (admission.hpp). Above 0, the image is not reproducible.
    [[nodiscard]] std::uint64_t differing_rounds() const { return differing_rounds_; }
    [[nodiscard]] const std::vector<DroppedSample>& dropped() const { return dropped_; }
    [[nodiscard]] const Conduct& conduct() const { return conduct_; }

  private:
    struct Server {
        std::string instance;
        std::string name;
        std::string who;  ///< By which its conduct is known.
        std::uint32_t pid = 0;
        Peer peer;
        FailureDetector detector;
        ProgressWatch progress;
        ClockEstimate clock{};
        std::optional<TimeNs> round_trip{};  ///< The shortest of late.
        TokenBucket allowance{};             ///< Of messages.
        Credits credits{0};
        SpeedEstimate speed{};
        Turnaround turnaround{};  ///< Of leases since `moved`.
        TimeNs moved = 0;         ///< When it was stuck last: what it held then says nothing of its speed.
        TimeNs next_ping = 0;
        TimeNs frames_heard = 0;  ///< CREDIT, TILE or NACK; or HELLO.
        std::uint64_t told_progress = 0;
        Epoch ready_for{};          ///< Of the last READY that was right.
        std::uint32_t at_once = 1;  ///< Leases that it works on side by side.
        bool asks = false;          ///< Is in asking_.
        bool same_bits = true;
        bool unreachable = false;  ///< When its connection was probed last.

        [[nodiscard]] bool stays() const {
            return peer.alive() && peer.state() != PeerState::draining && peer.state() != PeerState::stuck;
        }
    };
    /// A round of the client's own renderer: one part of it, or both; or one that was rendered before.
    struct LocalWork {
        std::optional<Lease> direct, indirect;
        std::optional<AuditedRound> audit;
        Epoch epoch;
    };
    /// Whose light is in the frame, though it may be gone.
    struct Author {
        std::string name, who;
        bool same_bits = true;
    };
    /// A process that this client started.
    struct LocalServer {
        std::uint32_t pid;
        std::string name;
        bool joined = false;
        bool ended = false;

        /// Process ids repeat from machine to machine: the name must be ours as well.
        [[nodiscard]] bool is(std::uint32_t other_pid, std::string_view other_name) const {
            return pid == other_pid && name == other_name;
        }
    };

    // client_machine.cpp: messages.
    void count_dropped(ServerId server, std::string_view sentence, Channel channel);
    void reject_undecodable(const std::string& instance, const DecodeError& error, Channel channel);
    bool may_answer(const std::string& stranger);
    bool ask_who(const std::string& instance);  ///< Whether it was time to.
    /// False if the peer is not connected.
    bool send(Channel channel, const std::string& instance, Message message, ServerId peer = k_local_server);
    void record(EventBody body);
    [[nodiscard]] RenderSettings own_frame() const;
    void enforce_time_limit();
    void begin_epoch(const PackMap& changes, bool same_frame);
    template <class Other>
    void on(Server&, Other&) {}  // HELLO is handled before; the rest never decodes for a client.

    // client_conduct.cpp: who misbehaves is shut out for a while.
    void offend(const std::string& who, Offence offence);
    void shut_out(const std::string& who, const Ban& ban);
    void reject_banned(const std::string& instance, const Ban& ban);

    // client_joining.cpp: from HELLO to READY, and the way out.
    void on_hello(const std::string& instance, const message::Hello& hello, const Sender& sender);
    void on(Server& server, message::SnapshotRequest& message);
    void on(Server& server, message::ManifestRequest& message);
    void on(Server& server, message::PieceRequest& message);
    void on(Server& server, message::Ready& message);
    void on(Server& server, message::Credit& message);
    void on(Server& server, message::Bye& message);
    [[nodiscard]] message::Welcome welcome(ServerId id) const;
    void step_peer(Server& server, PeerCause cause, std::string_view detail);
    void lose(const std::string& instance, PeerCause cause, std::string_view why);

    // client_heartbeats.cpp: who lives.
    void on(Server& server, message::Ping& message);
    void on(Server& server, message::Pong& message);
    void watch_progress(Server& server);
    bool ping(Server& server);
    void probe_connections();
    void watch_frames(const Server& server);
    void watch_heartbeats();

    // client_leases.cpp: leases out.
    [[nodiscard]] int alive_servers() const;
    [[nodiscard]] bool expects_servers() const;
    [[nodiscard]] bool renders_alone() const;
    void servers_changed() { tell_schedule_ = serve_all_ = true; }
    void tell_schedule();
    void hand_out();
    void hand_out_to_servers();
    bool hand_out_to(Server& server);
    [[nodiscard]] std::size_t window_of(const Server& server) const;
    [[nodiscard]] std::uint32_t rounds_per_lease_of(const Server& server) const;
    bool grant_to(Server& server);
    std::optional<Lease> grant_straggler(Server& server);
    void send_lease(Server& server, const Lease& lease);
    [[nodiscard]] std::optional<LocalWork> next_local_work();
    void hand_out_locally();
    void begin_local(LocalWork work);

    // client_work.cpp: light in.
    void on(Server& server, message::Tile& message);
    void on(Server& server, message::Nack& message);
    void settle(LightPart part, const Lease& lease, const std::optional<RoundResult>& result);
    void count_result(const RoundResult& result, ServerId server);
    void cancel_superseded(const std::vector<Lease>& leases);
    void cancel(const Lease& lease);
    void release(LeaseId lease, ServerId server);
    std::size_t revoke(ServerId server);  ///< How many leases ended.

    // client_audit.cpp: a second opinion.
    void note_merged(LightPart part, const ResultClaim& claim, std::uint32_t rounds,
                     const RoundResult& result, std::span<const PixelSum> sums);
    [[nodiscard]] std::optional<AuditedRound> next_audit(const Server& server) const;
    [[nodiscard]] std::uint32_t rounds_of(std::uint32_t unit, SampleRange samples) const;
    Lease grant_audit(const AuditedRound& item, ServerId server, TimeNs duration);
    [[nodiscard]] std::optional<AuditedRound> next_local_audit(bool disputes_only) const;
    void on_opinion(const ResultClaim& claim, std::span<const PixelSum> sums);
    [[nodiscard]] Digest hash_as_sent(std::vector<PixelSum> sums, std::uint32_t samples) const;
    void on_own_opinion(const LocalWork& work, const RoundOutcome& outcome);
    void convict(const Author& liar, const AuditedRound& item);
    std::size_t undo(const std::vector<std::uint32_t>& units);
    std::size_t begin_anew();
    std::uint64_t take_back(const std::vector<Contribution>& gave, bool indirect);

    ClientConfig config_;
    Strategy strategy_;
    ClientJob job_;
    EventStore& store_;
    ClientWorld& world_;
    TimeNs now_;  ///< Of what is happening.
    TimeNs started_;
    TimeNs heartbeat_;

    std::uint64_t session_;
    std::uint64_t sequence_ = 0;  ///< Of the last INPUT.
    std::string packed_state_;
    Digest state_hash_{};

    std::map<std::string, Server> servers_;  ///< By instance; those that live.
    std::vector<LocalServer> local_servers_;
    std::map<ServerId, Server*> server_by_id_;
    std::uint32_t last_server_ = 0;
    TimeNs next_look_ = 0;  ///< When all servers are looked at again.
    std::vector<Server*>
        asking_;                ///< Those that spoke since work was handed out: they may have room for more.
    bool serve_all_ = true;     ///< Others may get something as well.
    std::uint64_t places_ = 0;  ///< Leases that the servers work on, and one more for each to go on with.
    std::uint64_t rounds_open_ = 0;  ///< When work was handed out last.
    bool tell_schedule_ = true;      ///< Who may be given work has changed.
    bool reached_min_servers_ = false;
    bool announced_alone_ = false;
    std::map<std::string, TimeNs> answered_;  ///< Unknown peers, bounded.
    int probes_left_ = 0;                     ///< Of connections, after one was lost.
    TimeNs next_probe_ = 0, soonest_probe_ = 0;

    Conduct conduct_;
    Audit audit_;
    Contributions gave_direct_, gave_indirect_;  ///< In this epoch, if audits are asked for.
    std::map<ServerId, Author> authors_;         ///< Those that live, or gave something in this epoch.
    FrameWork work_;
    IndirectWork& indirect_;  ///< What servers are given: work_, or what is relayed.
    bool relays_;
    std::uint64_t work_seen_ = 0;
    std::vector<PixelSum> arrived_;  ///< Of the tile at hand: its memory serves for all.
    std::uint64_t last_ticket_ = 0;
    std::map<std::uint64_t, LocalWork> local_work_;  ///< In the client's renderer, by ticket.
    std::uint64_t saturated_ = 0;
    std::uint64_t differing_rounds_ = 0;
    std::vector<DroppedSample> dropped_;  ///< The first k_max_dropped_listed.
    bool stopped_ = false;
};

}  // namespace pathscope
