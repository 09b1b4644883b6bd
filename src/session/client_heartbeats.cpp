#include "pathscope/session/client_machine.hpp"

#include <fmt/format.h>

namespace pathscope {

void ClientMachine::on(Server& server, message::Ping& message) {
    send(Channel::monitor, server.instance,
         message::Pong{message.token, now_, now_, work_.indirect_ledger().rounds_committed(), 0},
         server.peer.id());
}

void ClientMachine::on(Server& server, message::Pong& message) {
    server.detector.on_heartbeat(now_);
    const auto rtt = server.clock.add({TimeNs(message.token), message.received_ns, message.sent_ns, now_});
    if (rtt) store_.add_latency(Latency::heartbeat, *rtt, server.peer.id());
}

void ClientMachine::watch_heartbeats() {
    std::vector<std::pair<std::string, std::string>> dead;
    for (auto& [instance, server] : servers_) {
        if (now_ >= server.next_ping) {
            send(Channel::monitor, instance,
                 message::Ping{std::uint64_t(now_), sequence_, work_.indirect_ledger().rounds_committed(), 0},
                 server.peer.id());
            server.next_ping = now_ + heartbeat_;
        }
        const Suspicion suspicion = server.detector.assess(now_);
        if (suspicion.state == Liveness::dead)
            dead.emplace_back(instance,
                              fmt::format("It has been silent for {:.2f} s.", to_seconds(suspicion.silence)));
        else if (suspicion.state == Liveness::suspect && server.peer.state() == PeerState::ready)
            step_peer(server, PeerCause::silent,
                      fmt::format("It has been silent for {:.2f} s.", to_seconds(suspicion.silence)));
        server.credits.write_off(now_);
    }
    for (const auto& [instance, why] : dead) lose(instance, PeerCause::lost, why);
}

}  // namespace pathscope
