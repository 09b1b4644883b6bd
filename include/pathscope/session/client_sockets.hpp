#pragma once
/// A client's three sockets and its door: of clients and of relays.
///
///     auto sockets = ClientSockets::open(context, config);        // config.ports are the real ones then
///     ready = wait_readable(sockets->pollables(), ...);
///     sockets->receive(ready, first, machine);  sockets->watch_door(ready, first, store, machine);  machine.on_timers(now);
///
/// `Machine`: ClientMachine or RelayMachine, that is, on_message, on_connection_lost and on_revoked.
/// Thread safety: one thread at a time.   Test: tests/session/test_cluster.cpp

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "pathscope/cluster/conduct.hpp"
#include "pathscope/net/context.hpp"
#include "pathscope/net/poller.hpp"
#include "pathscope/net/publisher.hpp"
#include "pathscope/net/router.hpp"
#include "pathscope/probe/event_store.hpp"
#include "pathscope/session/client_config.hpp"
#include "pathscope/session/door.hpp"

namespace pathscope {

/// A random number of a run, not 0.
[[nodiscard]] std::uint64_t random_session();

class ClientSockets {
  public:
    /// Takes the ports of the configuration, or where it allows that any free ones, and notes them there.
    [[nodiscard]] static Result<ClientSockets> open(const Context& context, ClientConfig& config);

    [[nodiscard]] std::vector<Pollable> pollables() const;

    /// Tells the machine what came. The bits of pollables() begin at `first`.
    template <class Machine>
    void receive(const Readable& ready, std::size_t first, Machine& machine) {
        if (ready[first]) receive(bound_.monitor, Channel::monitor, machine);
        if (ready[first + 1]) receive(bound_.frames, Channel::frames, machine);
        if (ready[first + 2]) bound_.input.count_subscriptions();
    }

    /// Who was turned away is counted; who hung up is looked for; who was taken off the list is given up at once.
    template <class Machine>
    void watch_door(const Readable& ready, std::size_t first, EventStore& store, Machine& machine) {
        const TimeNs now = monotonic_now();
        // To ask the door costs several system calls: when there is a knock, and now and then.
        bool knock = false;
        for (std::size_t i = 0; i < door_.watched(); ++i) knock = knock || ready[first + k_sockets + i];
        if (knock || now >= next_door_look_) {
            next_door_look_ = now + k_door_watch;
            const Door::News news = door_.step(now, bound_.input);
            if (news.refused > 0) store.count(Counter::refused_peers, news.refused);
            if (news.lost > 0) machine.on_connection_lost(now);
        }
        for (RouterSocket* socket : {&bound_.monitor, &bound_.frames})
            for (const std::string& instance : socket->take_revoked())
                machine.on_revoked(instance, "Its key was taken off the list.", now);
    }

    bool send(Channel channel, const std::string& instance, Frames frames);
    void publish(Frames frames) { bound_.input.publish(std::move(frames)); }

    [[nodiscard]] const Door& door() const { return door_; }
    [[nodiscard]] std::array<std::string, 3> endpoints() const {
        return {bound_.input.endpoint(), bound_.monitor.endpoint(), bound_.frames.endpoint()};
    }

  private:
    static constexpr std::size_t k_sockets = 3;  ///< Of pollables(); the others are the door's.
    static constexpr TimeNs k_door_watch =
        50 * k_millisecond_ns;                       ///< How often it is looked at though nobody knocks.
    static constexpr int k_messages_per_turn = 200;  ///< Per socket, so that heartbeats are never starved.

    struct Bound {
        PublisherSocket input;
        RouterSocket monitor;
        RouterSocket frames;
    };
    ClientSockets(Door door, Bound bound) : door_(std::move(door)), bound_(std::move(bound)) {}
    [[nodiscard]] static Result<Bound> bind(const Context& context, const ClientConfig& config,
                                            const Door& door, bool any_ports);

    template <class Machine>
    static void receive(RouterSocket& socket, Channel channel, Machine& machine) {
        drain(socket, k_messages_per_turn, [&](RoutedMessage message) {
            const Sender sender{std::move(message.key), std::move(message.address)};
            machine.on_message(message.peer, std::move(message.frames), channel, monotonic_now(), sender);
        });
    }

    Door door_;
    Bound bound_;
    TimeNs next_door_look_ = 0;
};

}  // namespace pathscope
