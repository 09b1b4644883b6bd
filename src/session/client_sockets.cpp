#include "pathscope/session/client_sockets.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "pathscope/core/log.hpp"
#include "pathscope/net/dealer.hpp"
#include "pathscope/net/descriptor_limit.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_wanted_descriptors =
    3 * 4096 + 256;  ///< Three connections of each server we may take.

}  // namespace

std::uint64_t random_session() {
    const std::string bytes = random_routing_id();
    std::uint64_t number = 0;
    for (int i = 0; i < 8; ++i) number = number << 8 | std::uint8_t(bytes[std::size_t(i)]);
    return std::max<std::uint64_t>(number, 1);
}

Result<ClientSockets::Bound> ClientSockets::bind(const Context& context, const ClientConfig& config,
                                                 const Door& door, bool any_ports) {
    const auto endpoint = [&](std::size_t channel) {
        return any_ports ? fmt::format("tcp://{}:*", config.host)
                         : fmt::format("tcp://{}:{}", config.host, config.ports[channel]);
    };
    auto input = PublisherSocket::bind(context, endpoint(0), door.options(Channel::input));
    if (!input) return input.error();
    auto monitor = RouterSocket::bind(context, endpoint(1), door.options(Channel::monitor));
    if (!monitor) return monitor.error();
    auto frames = RouterSocket::bind(context, endpoint(2), door.options(Channel::frames));
    if (!frames) return frames.error();
    return Bound{std::move(*input), std::move(*monitor), std::move(*frames)};
}

Result<ClientSockets> ClientSockets::open(const Context& context, ClientConfig& config) {
    raise_descriptor_limit(k_wanted_descriptors);
    Result<Door> door = Door::open(context, config);
    if (!door) return door.error();
    Result<Bound> bound = bind(context, config, *door, config.any_ports);
    const bool may_move = !config.ports_were_chosen && !config.listens;
    const bool moved = !bound && may_move;
    if (moved) bound = bind(context, config, *door, true);
    if (!bound) return bound.error();
    ClientSockets sockets(std::move(*door), std::move(*bound));
    const auto watched =
        sockets.door_.watch(sockets.bound_.input, sockets.bound_.monitor, sockets.bound_.frames);
    if (!watched) return watched.error();
    const auto endpoints = sockets.endpoints();
    for (std::size_t i = 0; i < endpoints.size(); ++i)
        config.ports[i] = std::stoi(endpoints[i].substr(endpoints[i].rfind(':') + 1));
    if (moved)
        log_note(fmt::format("The default ports are in use; this run takes {}, {} and {}.", config.ports[0],
                             config.ports[1], config.ports[2]));
    return sockets;
}

std::vector<Pollable> ClientSockets::pollables() const {
    std::vector<Pollable> all{bound_.monitor.pollable(), bound_.frames.pollable(), bound_.input.pollable()};
    for (const Pollable& connections : door_.pollables()) all.push_back(connections);
    return all;
}

bool ClientSockets::send(Channel channel, const std::string& instance, Frames frames) {
    RouterSocket& socket = channel == Channel::monitor ? bound_.monitor : bound_.frames;
    return socket.send(instance, std::move(frames)) == SendOutcome::delivered;
}

}  // namespace pathscope
