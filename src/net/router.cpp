#include "pathscope/net/router.hpp"

#include <algorithm>
#include <cerrno>

#include "context_state.hpp"
#include "pathscope/core/check.hpp"
#include "zmq_call.hpp"

namespace pathscope {
namespace {

constexpr int k_max_dropped_at_once = 100;
constexpr std::size_t k_max_revoked = 4096;  ///< Names kept until they are taken.

}  // namespace

Result<RouterSocket> RouterSocket::bind(const Context& context, const std::string& endpoint,
                                        const SocketOptions& options) {
    auto socket = open_socket(context, ZMQ_ROUTER, options);
    if (!socket) return socket.error();
    set_option(socket->get(), ZMQ_ROUTER_MANDATORY, 1);
    const auto bound = bind_socket(socket->get(), endpoint);
    if (!bound) return bound.error();

    RouterSocket router;
    router.endpoint_ = bound_endpoint(socket->get());
    router.has_keys_ = std::holds_alternative<Listener>(options.security);
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
    // Bounded, so that one who is not listed any more and floods keeps nobody from being heard.
    for (int dropped = 0; dropped < k_max_dropped_at_once; ++dropped) {
        Origin origin;
        auto frames = receive_frames(socket_.get(), &origin);
        if (!frames) return std::nullopt;
        if (has_keys_ && !socket_.context().doorkeeper->admits(origin.key)) {
            if (std::find(revoked_.begin(), revoked_.end(), frames->front()) == revoked_.end() &&
                revoked_.size() < k_max_revoked)
                revoked_.push_back(frames->front());
            disconnect(origin, endpoint_);
            continue;
        }
        RoutedMessage message{std::move(frames->front()), std::move(*frames), std::move(origin.key),
                              std::move(origin.address)};
        message.frames.erase(message.frames.begin());
        return message;
    }
    return std::nullopt;
}

}  // namespace pathscope
