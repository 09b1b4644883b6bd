#include "pathscope/net/router.hpp"

#include <cerrno>

#include "pathscope/core/check.hpp"
#include "zmq_call.hpp"

namespace pathscope {

Result<RouterSocket> RouterSocket::bind(const Context& context, const std::string& endpoint,
                                        const SocketOptions& options) {
    auto socket = open_socket(context, ZMQ_ROUTER, options);
    if (!socket) return socket.error();
    set_option(socket->get(), ZMQ_ROUTER_MANDATORY, 1);
    const auto bound = bind_socket(socket->get(), endpoint);
    if (!bound) return bound.error();

    RouterSocket router;
    router.endpoint_ = bound_endpoint(socket->get());
    router.socket_ = std::move(*socket);
    return router;
}

SendOutcome RouterSocket::send(const std::string& peer, Frames&& frames) {
    const int error = send_frames(socket_.get(), &peer, frames);
    if (error == 0) return SendOutcome::delivered;
    if (error == EHOSTUNREACH) return SendOutcome::unreachable;
    CHECK(error == EAGAIN, error, zmq_strerror(error));
    return SendOutcome::would_block;
}

std::optional<RoutedMessage> RouterSocket::receive() {
    auto frames = receive_frames(socket_.get());
    if (!frames) return std::nullopt;
    RoutedMessage message{std::move(frames->front()), std::move(*frames)};
    message.frames.erase(message.frames.begin());
    return message;
}

}  // namespace pathscope
