#pragma once
/// A relay as a state machine: one server towards the client above, a client towards the servers below.
///
///     client  <--->  ServerMachine | RelayWork | ClientMachine  <--->  servers, or relays
///                    above()         adds up     below
///
/// Why of the two machines that exist: a relay has to keep every promise of both sides of the protocol, and they are written
/// once. A lease from above becomes rounds for those below, and their sum its tile (relay_work.hpp); the state and the
/// scene's files go down as they came; heartbeats, deadlines, bans and the account of rounds are each side's own. So the client
/// has one peer in place of many, and its work per sample falls by what a lease holds more than a round.
///
/// A relay renders nothing. Without servers it is none itself: it leaves its client, and dials when somebody comes.
/// Sums below are always exact, whatever form the client wants: they are rounded once, at the relay, so that its tile is that
/// of one server that rendered the whole lease.
/// Only servers of its own bits come in, and it tells the client its own: so the client's admission holds for them all.
/// Requires: `now` never falls.   Thread safety: one thread at a time.
/// Test: tests/session/test_relay.cpp, test_simulation.cpp

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pathscope/session/client_machine.hpp"
#include "pathscope/session/relay_work.hpp"
#include "pathscope/session/server_machine.hpp"

namespace pathscope {

/// The files of a scene, found whole in the relay's cache.
struct CheckedScene {
    RenderState state;  ///< Whose scene it is.
    Result<SceneDepot> depot;
};

/// What the machine does to the world.
class RelayWorld {
  public:
    virtual ~RelayWorld() = default;

    /// To the client. False if it did not leave: then the frames are still there.
    virtual bool send_up(Channel channel, Frames&& frames) = 0;

    /// To a server. False if it is not connected or does not keep up; then the message is gone.
    virtual bool send_down(Channel channel, const std::string& instance, Frames frames) = 0;
    /// To all servers, on the input channel; may be lost on its way to any of them.
    virtual void publish_down(Frames frames) = 0;

    /// Begins to look whether the files in the cache are what the manifest says; it comes back by on_checked(). One at a time.
    virtual void check_scene(RenderState state, Manifest manifest) = 0;
};

class RelayMachine {
  public:
    /// below: how to deal with servers; its frame options mean nothing here. session: random, not 0. `store` and `world`
    /// outlive the machine.
    RelayMachine(ServerIdentity identity, SceneCache cache, const ClientConfig& below, std::uint64_t session,
                 EventStore& store, RelayWorld& world);

    // -- What happens above ---------------------------------------------------------------------------------

    /// To be told of the link to the client and what comes by it.
    [[nodiscard]] ServerMachine& above() { return above_; }
    [[nodiscard]] const ServerMachine& above() const { return above_; }
    /// Whether the client is to be dialled: somebody is there to work for it.
    [[nodiscard]] bool wants_client(TimeNs now) const;
    void on_checked(CheckedScene& checked, TimeNs now);

    // -- What happens below: as ClientMachine ---------------------------------------------------------------
    void on_message(const std::string& instance, Frames frames, Channel channel, TimeNs now,
                    const Sender& sender = {});
    void on_connection_lost(TimeNs now);
    void on_revoked(const std::string& instance, std::string_view why, TimeNs now);
    void on_own_pause(TimeNs pause);

    /// Does what is due. To be called after everything else that happened, and at next_timer().
    void on_timers(TimeNs now);
    [[nodiscard]] TimeNs next_timer(TimeNs now) const;

    /// The end: what was not begun goes back, what was is finished; then both sides hear goodbye.
    void drain(TimeNs now) { above_.drain(now); }
    [[nodiscard]] bool drained() const { return above_.drained(); }
    void say_goodbye(TimeNs now);

    // -- View -----------------------------------------------------------------------------------------------
    [[nodiscard]] const RelayWork& work() const { return work_; }
    /// The side towards servers; nothing before there was a state to welcome them with.
    [[nodiscard]] const ClientMachine* below() const { return below_ ? &*below_ : nullptr; }

  private:
    /// A server that said HELLO before it could be welcomed; or something else, and was told to: then `hello` is empty.
    struct Caller {
        Frames hello{};
        Sender sender{};
        TimeNs at = 0;
    };
    struct AboveWorld final : ServerWorld {
        explicit AboveWorld(RelayMachine& machine) : relay(machine) {}
        bool send(Channel channel, Frames&& frames) override;
        void begin(RoundJob job) override;
        void cancel(std::uint64_t ticket) override;
        void cancel_all() override;
        [[nodiscard]] std::uint64_t work_done() const override;
        [[nodiscard]] std::uint32_t leases_at_once() const override { return relay.at_once_; }
        [[nodiscard]] bool works_on(std::uint64_t ticket) const override;
        void on_state(const RenderState& state) override;
        void load(RenderState state, Manifest manifest) override;
        RelayMachine& relay;
    };
    struct BelowWorld final : ClientWorld {
        explicit BelowWorld(RelayMachine& machine) : relay(machine) {}
        bool send(Channel channel, const std::string& instance, Frames frames) override;
        void publish(Frames frames) override;
        void begin(RoundJob job) override;
        void cancel_all() override {}
        RelayMachine& relay;
    };

    void keep_caller(const std::string& instance, Frames frames, Channel channel, const Sender& sender);
    void pass_down(RenderState state, TimeNs now);
    void withdraw(const std::vector<Lease>& leases);
    void tell_loaded(bool in_step);
    void look_at_servers();
    [[nodiscard]] const SceneDepot& depot_of(const RenderState& state) const;

    ClientConfig config_;
    std::uint64_t session_;
    EventStore& store_;
    RelayWorld& world_;
    TimeNs now_ = 0;

    AboveWorld above_world_{*this};
    BelowWorld below_world_{*this};
    RelayWork work_;
    ServerMachine above_;
    std::map<std::string, Caller> callers_;  ///< By instance, bounded.
    std::optional<ClientMachine> below_;
    std::vector<std::pair<Digest, SceneDepot>>
        depots_;  ///< By `files` of the state: of the scene that the machine above has, and of the last one checked.
    std::optional<LoadedScene>
        to_load_;  ///< Checked; the machine above is told when a server below is ready.

    TimeNs next_look_ = 0;
    bool any_ready_ = false;  ///< A server below.
    TimeNs last_ready_ = 0;   ///< When one was.
    std::uint32_t at_once_ = 1;
};

}  // namespace pathscope
