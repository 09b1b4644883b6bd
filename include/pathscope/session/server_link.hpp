#pragma once
/// A server's three sockets to its client, and when it dials: of servers and of relays.
///
///     if (!machine.linked() && now >= link.next_dial()) link.dial(machine);
///     wait_readable(link.pollables(), ...);   link.receive(ready, first, machine);   machine.on_timers(now);
///
/// Refused at the door, it says so and dials anew after a pause, as ZeroMQ does not.
/// Thread safety: one thread at a time.   Test: tests/session/test_cluster.cpp, tests/system/test_security.py

#include <array>
#include <optional>
#include <string>

#include "pathscope/net/context.hpp"
#include "pathscope/net/dealer.hpp"
#include "pathscope/net/poller.hpp"
#include "pathscope/net/subscriber.hpp"
#include "pathscope/session/refusal.hpp"
#include "pathscope/session/server_machine.hpp"

namespace pathscope {

/// Whom a server dials, and as whom.
struct ClientAddress {
    std::string host;
    std::array<int, 3> ports{};
    Security security;  ///< A Dialler, or none.
    std::string name;   ///< Of the server, for sentences.
};

class ServerLink {
  public:
    static constexpr std::size_t k_pollables = 4;

    ServerLink(const Context& context, ClientAddress client)
        : context_(context), client_(std::move(client)) {}

    /// New sockets, by a new routing id, which the machine is told. Those that were there close.
    Result<void> dial(ServerMachine& machine);
    [[nodiscard]] TimeNs next_dial() const { return redial_.next(); }
    void close() { sockets_.reset(); }
    [[nodiscard]] bool open() const { return sockets_.has_value(); }

    /// Requires: open(), as below.
    [[nodiscard]] std::array<Pollable, k_pollables> pollables() const;
    /// Tells the machine what came. The bits of pollables() begin at `first`.
    void receive(const Readable& ready, std::size_t first, ServerMachine& machine);
    bool send(Channel channel, Frames&& frames);

  private:
    struct Sockets {
        SubscriberSocket input;
        DealerSocket monitor;
        ConnectionWatch watch;  ///< Of monitor; the others share its fate.
        DealerSocket frames;
    };

    [[nodiscard]] std::string endpoint(std::size_t channel) const;
    void on_connection_changes(ServerMachine& machine);

    Context context_;
    ClientAddress client_;
    Redial redial_;
    std::optional<Sockets> sockets_;
};

}  // namespace pathscope
