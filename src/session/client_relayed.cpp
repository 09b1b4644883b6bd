/// What a relay (relay_machine.hpp) asks of the side of it that is a client.

#include <algorithm>
#include <utility>

#include "pathscope/session/client_machine.hpp"

namespace pathscope {

void ClientMachine::change_scene(RenderState state, std::shared_ptr<const Scene> scene, SceneDepot depot,
                                 TimeNs now) {
    job_.depot = std::move(depot);
    change_state(std::move(state), std::move(scene), now);
}

void ClientMachine::withdraw(const std::vector<Lease>& leases) { cancel_superseded(leases); }

int ClientMachine::servers_in_step() const {
    return int(std::count_if(servers_.begin(), servers_.end(), [this](const auto& entry) {
        return entry.second.peer.accepts_work() && entry.second.ready_for == epoch();
    }));
}

std::size_t ClientMachine::leases_wanted() const {
    std::size_t leases = 0;
    for (const auto& [instance, server] : servers_)
        if (server.peer.accepts_work()) leases += std::min(server.credits.limit(), window_of(server));
    return leases;
}

}  // namespace pathscope
