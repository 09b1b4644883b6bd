#include <algorithm>

#include "pathscope/cluster/figures.hpp"
#include "pathscope/session/client_machine.hpp"

namespace pathscope {

ClusterFigures ClientMachine::figures() const {
    ClusterFigures figures;
    for (const auto& [instance, server] : servers_) {
        const PeerState state = server.peer.state();
        ++figures.servers[std::size_t(state)];
        figures.living.push_back(server.peer.id());
        if (state == PeerState::ready || state == PeerState::suspect)
            figures.samples_per_second += server.speed.per_second();
    }
    std::sort(figures.living.begin(), figures.living.end());
    figures.direct = work_.direct_progress();
    figures.indirect = work_.indirect_progress();
    if (stopped_) return figures;

    // What is left of the samples or, with a time limit, of the time: whichever ends first.
    const RenderSettings& settings = job_.state.settings;
    figures.samples_left = (1 - figures.indirect) * double(settings.spp) * settings.width * settings.height;
    if (config_.time_limit > 0 && figures.samples_per_second > 0) {
        const double seconds = to_seconds(std::max<TimeNs>(0, started_ + config_.time_limit - now_));
        figures.samples_left = std::min(figures.samples_left, seconds * figures.samples_per_second);
    }
    return figures;
}

}  // namespace pathscope
