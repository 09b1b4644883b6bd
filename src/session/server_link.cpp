#include "pathscope/session/server_link.hpp"

#include <fmt/format.h>

#include "channel_options.hpp"
#include "pathscope/core/log.hpp"

namespace pathscope {
namespace {

constexpr int k_messages_per_turn = 100;  ///< Per socket, so that none starves the others.

}  // namespace

std::string ServerLink::endpoint(std::size_t channel) const {
    return fmt::format("tcp://{}:{}", client_.host, client_.ports[channel]);
}

Result<void> ServerLink::dial(ServerMachine& machine) {
    sockets_.reset();
    const std::string instance = random_routing_id();
    // Input first: what is published after WELCOME was made must not be missed if it can be helped.
    auto input = SubscriberSocket::connect(context_, endpoint(0), std::string(k_input_topic),
                                           channel_options(Channel::input, client_.security));
    if (!input) return input.error();
    auto monitor = DealerSocket::connect_watched(context_, endpoint(1), instance,
                                                 channel_options(Channel::monitor, client_.security));
    if (!monitor) return monitor.error();
    auto frames = DealerSocket::connect(context_, endpoint(2), instance,
                                        channel_options(Channel::frames, client_.security));
    if (!frames) return frames.error();
    sockets_.emplace(Sockets{std::move(*input), std::move(monitor->dealer), std::move(monitor->watch),
                             std::move(*frames)});
    machine.on_linked(instance, monotonic_now());
    return {};
}

std::array<Pollable, ServerLink::k_pollables> ServerLink::pollables() const {
    return {sockets_->monitor.pollable(), sockets_->frames.pollable(), sockets_->input.pollable(),
            sockets_->watch.pollable()};
}

void ServerLink::receive(const Readable& ready, std::size_t first, ServerMachine& machine) {
    const auto pass_on = [&](auto& socket, Channel channel) {
        drain(socket, k_messages_per_turn,
              [&](Frames frames) { machine.on_message(std::move(frames), channel, monotonic_now()); });
    };
    if (ready[first]) pass_on(sockets_->monitor, Channel::monitor);
    if (ready[first + 1]) pass_on(sockets_->frames, Channel::frames);
    if (ready[first + 2]) pass_on(sockets_->input, Channel::input);
    if (ready[first + 3]) on_connection_changes(machine);
    if (machine.welcomed()) redial_.on_welcome();
}

void ServerLink::on_connection_changes(ServerMachine& machine) {
    const ConnectionChanges changes = sockets_->watch.take_changes();
    if (changes.lost > 0) machine.on_connection_lost(monotonic_now());
    for (const Refusal& refusal : changes.refusals) {
        const auto sentence =
            redial_.on_refused(refusal.reason, endpoint(1), client_.security, monotonic_now());
        if (sentence) log_warning(fmt::format("{}: {}", client_.name, *sentence));
        machine.on_refused(monotonic_now());
    }
}

bool ServerLink::send(Channel channel, Frames&& frames) {
    DealerSocket& socket = channel == Channel::monitor ? sockets_->monitor : sockets_->frames;
    return socket.send(std::move(frames)) == SendOutcome::delivered;
}

}  // namespace pathscope
