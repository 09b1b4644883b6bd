#pragma once
/// A render server as a state machine, from its first HELLO to its last BYE: docs/protocol.md, section 6.1.
///
///     DIAL -> HELLO -> SYNC (state, scene) -> WORK (leases) -> ... ; a lost client leads back to DIAL
///
/// What it holds is only what the client said last: the state with its sequence number, and the scene's files by hash.
/// Why no socket, no clock, no thread: as client_machine.hpp.
/// Requires: `now` never falls.
/// Thread safety: one thread at a time.   Test: tests/session/test_simulation.cpp, test_cluster.cpp

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "pathscope/core/clock.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/protocol/block_result.hpp"
#include "pathscope/protocol/codec.hpp"
#include "pathscope/session/admission.hpp"
#include "pathscope/session/render_state.hpp"
#include "pathscope/session/round_runner.hpp"
#include "pathscope/session/scene_cache.hpp"
#include "pathscope/session/scene_fetch.hpp"

namespace pathscope {

/// What a server says of itself.
struct ServerIdentity {
    std::string name;  ///< For people.
    std::string version;
    BitsIdentity bits;  ///< own_bits() of the program.
    std::uint32_t threads = 1;
    std::uint32_t pid = 0;
    std::string client = "127.0.0.1";  ///< Whom it dials, for sentences.
};

struct LoadedScene {
    RenderState state;  ///< What it was loaded for.
    Result<std::shared_ptr<const Scene>> scene;
};

/// What the machine does to the world.
class ServerWorld {
  public:
    virtual ~ServerWorld() = default;

    /// To the client, on monitor or frames. False if it did not leave: then the frames are still there.
    virtual bool send(Channel channel, Frames&& frames) = 0;

    /// Puts the result of a round into its tile.
    virtual void fill_tile(message::Tile& tile, const RoundResult& result, WireFormat format) const;

    /// Begins a round. Each has one outcome: on_outcome(). A cancelled one has it soon.
    virtual void begin(RoundJob job) = 0;
    virtual void cancel(std::uint64_t ticket) = 0;
    virtual void cancel_all() = 0;

    /// A number that rises while rounds are worked on, within a round as well: heartbeats carry it.
    [[nodiscard]] virtual std::uint64_t work_done() const = 0;

    /// Of the rounds that were begun: how many are worked on side by side, and whether this one is. The first always is.
    [[nodiscard]] virtual std::uint32_t leases_at_once() const { return 1; }
    [[nodiscard]] virtual bool works_on(std::uint64_t /*ticket*/) const { return false; }

    /// From here on rounds are of this state.
    virtual void on_state(const RenderState& /*state*/) {}

    /// Begins to load a scene whose files are in the cache; it comes back by on_loaded(). One at a time.
    virtual void load(RenderState state, Manifest manifest) = 0;
    /// Whether load() reads files. If not, none are fetched, and its manifest is empty.
    [[nodiscard]] virtual bool reads_files() const { return true; }
};

class ServerMachine {
  public:
    /// `world` outlives the machine.
    ServerMachine(ServerIdentity identity, SceneCache cache, ServerWorld& world)
        : identity_(std::move(identity)), world_(world), cache_(std::move(cache)) {}

    // -- What happens ---------------------------------------------------------------------------------------

    /// New sockets, by that routing id, are on their way to the client. Ensures: linked().
    void on_linked(std::string instance, TimeNs now);
    /// The client's door did not let it in, and told so on the connection itself: new sockets are needed.
    void on_refused(TimeNs now);
    /// The connection to the client ended, and ZeroMQ makes another one: whoever answers there next may know of no ban.
    void on_connection_lost(TimeNs now);
    void on_message(Frames frames, Channel channel, TimeNs now);
    void on_outcome(RoundOutcome& outcome, TimeNs now);
    void on_loaded(LoadedScene& loaded, TimeNs now);

    /// Does what is due. To be called after everything else that happened, and at next_timer(). May end the link: then new
    /// sockets are wanted.
    void on_timers(TimeNs now);
    [[nodiscard]] TimeNs next_timer(TimeNs now) const;

    /// No new lease: gives back those that were not begun, and finishes the one in work.
    void drain(TimeNs now);
    [[nodiscard]] bool drained() const { return leases_.empty() && unsent_answers_.empty(); }
    /// The last word. Nothing may be sent after it.
    void say_goodbye(TimeNs now);
    /// Goodbye, but not for ever: ends the link, and may be linked again. Requires: linked().
    void leave(std::string why, TimeNs now);

    // -- View -----------------------------------------------------------------------------------------------

    [[nodiscard]] TimeNs now() const { return now_; }  ///< Of what happened last.
    [[nodiscard]] bool linked() const { return linked_; }
    [[nodiscard]] bool welcomed() const { return linked_ && phase_ != Phase::hello; }
    /// The client said stop, or refused this server for good: refusal() tells why.
    [[nodiscard]] bool ended() const { return ended_; }
    [[nodiscard]] const std::optional<Error>& refusal() const { return refusal_; }
    [[nodiscard]] std::size_t leases() const { return leases_.size(); }
    [[nodiscard]] std::size_t unsent_answers() const { return unsent_answers_.size(); }
    /// Whether the scene that is here is of these files: then a state of it may come, and there is nothing to load.
    [[nodiscard]] bool has_scene(const Digest& files) const { return scene_ && scene_state_->files == files; }
    /// Hash of the state that it works on.
    [[nodiscard]] std::optional<Digest> working_on() const {
        return held_ && phase_ == Phase::work ? std::optional(held_->hash) : std::nullopt;
    }

  private:
    enum class Phase { hello, sync, work };

    /// The state as the client numbers it.
    struct HeldState {
        RenderState state;
        Epoch epoch;
        std::uint64_t sequence = 0;
        Digest hash{};
    };

    // server_machine.cpp: the link, time, and sending.
    void relink(std::string why);
    void lose_link();
    void end(std::optional<Error> refusal);
    void beat();
    bool send_monitor(Message message);
    void send_answer(Message message);
    void flush_answers();
    void on(message::Who& message);
    void on(message::Bye& message);
    void on(message::Ping& message);
    template <class Other>
    void on(Other&) {}  // Known, but of no use to a server: PONG, and what only clients receive.

    // server_state.cpp: joining, the state, the scene.
    void on(message::Welcome& message);
    void on(message::Reject& message);
    void on(message::Snapshot& message);
    void on(message::Input& message);
    void on(message::Manifest& message);
    void on(message::Piece& message);
    void take_state(const std::string& bytes, Epoch epoch, std::uint64_t sequence, const Digest& hash);
    void hold(HeldState held);
    void ask_for_snapshot();
    void advance_scene();
    void scene_failed(const Error& error);
    void become_ready();
    void send_ready();

    // server_work.cpp: leases.
    void on(message::Lease& message);
    void on(message::Cancel& message);
    [[nodiscard]] bool holds_lease(LeaseId lease) const;
    void refuse(const message::Lease& lease, NackCode code, std::string text = {});

    ServerIdentity identity_;
    ServerWorld& world_;
    TimeNs now_ = 0;  ///< Of what is happening.
    bool ended_ = false;
    std::optional<Error> refusal_;

    std::string instance_;
    bool linked_ = false;
    /// Drop the link once the messages at hand are handled; empty if there is nothing to tell.
    std::optional<std::string> relink_reason_;
    Phase phase_ = Phase::hello;
    bool draining_ = false;

    // What the client told.
    std::uint64_t session_ = 0;
    std::uint32_t credits_ = 0;
    LeaseId received_{};  ///< The largest so far.
    TimeNs heartbeat_ = 250 * k_millisecond_ns;
    TimeNs dead_after_ = 2 * k_second_ns;
    std::optional<HeldState> held_;

    // Timers.
    TimeNs last_heard_ = 0;
    TimeNs next_hello_ = 0;
    TimeNs hello_not_before_ = 0;  ///< The client said so; it hears nothing before.
    TimeNs hello_pause_ = 0;
    TimeNs next_ping_ = 0;
    std::optional<TimeNs> missed_since_;  ///< A PING told of an INPUT that has not come.
    std::optional<TimeNs> snapshot_asked_;

    // The scene, and the work on it.
    SceneCache cache_;
    std::optional<SceneFetch> fetch_;
    int fetch_failures_ = 0;
    std::optional<Manifest> loading_{};       ///< The files of the scene that the world is loading.
    std::optional<RenderState> scene_state_;  ///< What scene_ was loaded for.
    std::shared_ptr<const Scene> scene_;
    std::map<std::uint64_t, message::Lease> leases_;  ///< Those being rendered, by ticket.
    std::uint64_t last_ticket_ = 0;  ///< Lease numbers repeat from client to client, tickets do not.
    std::deque<Frames>
        unsent_answers_;  ///< TILE and NACK that the socket would not take yet; bounded by credits.
};

}  // namespace pathscope
