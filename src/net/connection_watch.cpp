#include "pathscope/net/connection_watch.hpp"

#include <fmt/format.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>

#include "zmq_call.hpp"

namespace pathscope {
namespace {

constexpr int k_refused_events = ZMQ_EVENT_HANDSHAKE_FAILED_AUTH | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                                 ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL;
constexpr int k_watched_events = ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_DISCONNECTED | k_refused_events;

void count_event(int event, ConnectionChanges& changes) {
    if (event == ZMQ_EVENT_HANDSHAKE_SUCCEEDED) ++changes.accepted;
    if (event == ZMQ_EVENT_DISCONNECTED) ++changes.lost;
    if (event & k_refused_events) ++changes.refused;
}

}  // namespace

Result<ConnectionWatch> ConnectionWatch::watch(const Context& context, const RouterSocket& router) {
    static std::atomic<unsigned> counter{0};
    const std::string address = fmt::format("inproc://connection-watch-{}", counter++);
    SocketOptions options;
    // ZeroMQ's I/O thread would wait for room in this queue, and everything with it.
    options.send_limit = options.receive_limit = 0;
    auto socket = open_socket(context, ZMQ_PAIR, options);
    if (!socket) return socket.error();
    if (zmq_socket_monitor(router.pollable().socket, address.c_str(), k_watched_events) != 0)
        return failed(
            fmt::format("Cannot watch the connections of {}: {}.", router.endpoint(), zmq_strerror(errno)));
    const auto connected = connect_socket(socket->get(), address);
    if (!connected) return connected.error();

    ConnectionWatch watch;
    watch.socket_ = std::move(*socket);
    return watch;
}

ConnectionChanges ConnectionWatch::take_changes() {
    ConnectionChanges changes;
    for (int i = 0; i < 1000; ++i) {
        const auto frames = receive_frames(socket_.get());
        if (!frames) break;
        // Number of the event in 16 bits, in the order of this machine, then a value that is not needed here.
        std::uint16_t event = 0;
        if (frames->front().size() >= sizeof event) std::memcpy(&event, frames->front().data(), sizeof event);
        count_event(event, changes);
    }
    return changes;
}

}  // namespace pathscope
