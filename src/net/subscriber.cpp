#include "pathscope/net/subscriber.hpp"

#include "zmq_call.hpp"

namespace pathscope {

Result<SubscriberSocket> SubscriberSocket::connect(const Context& context, const std::string& endpoint,
                                                   const std::string& topic, const SocketOptions& options) {
    auto socket = open_socket(context, ZMQ_SUB, options);
    if (!socket) return socket.error();
    set_option(socket->get(), ZMQ_SUBSCRIBE, topic);
    const auto connected = connect_socket(socket->get(), endpoint);
    if (!connected) return connected.error();

    SubscriberSocket subscriber;
    subscriber.socket_ = std::move(*socket);
    return subscriber;
}

std::optional<Frames> SubscriberSocket::receive() { return receive_frames(socket_.get()); }

}  // namespace pathscope
