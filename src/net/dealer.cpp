#include "pathscope/net/dealer.hpp"

#include <cerrno>
#include <random>

#include "pathscope/core/check.hpp"
#include "zmq_call.hpp"

namespace pathscope {

std::string random_routing_id() {
    std::random_device device;
    std::uniform_int_distribution<int> first(1, 255), other(0, 255);
    std::string id(16, static_cast<char>(first(device)));
    for (std::size_t i = 1; i < id.size(); ++i) id[i] = static_cast<char>(other(device));
    return id;
}

Result<DealerSocket> DealerSocket::open(const Context& context, const std::string& routing_id,
                                        const SocketOptions& options) {
    CHECK(!routing_id.empty() && routing_id.size() <= 255 && routing_id[0] != 0, routing_id.size());
    auto socket = open_socket(context, ZMQ_DEALER, options);
    if (!socket) return socket.error();
    set_option(socket->get(), ZMQ_ROUTING_ID, routing_id);
    set_option(socket->get(), ZMQ_IMMEDIATE, 1);
    DealerSocket dealer;
    dealer.socket_ = std::move(*socket);
    return dealer;
}

Result<DealerSocket> DealerSocket::connect(const Context& context, const std::string& endpoint,
                                           const std::string& routing_id, const SocketOptions& options) {
    auto dealer = open(context, routing_id, options);
    if (!dealer) return dealer.error();
    const auto connected = connect_socket(dealer->socket_.get(), endpoint);
    if (!connected) return connected.error();
    return dealer;
}

Result<WatchedDealer> DealerSocket::connect_watched(const Context& context, const std::string& endpoint,
                                                    const std::string& routing_id,
                                                    const SocketOptions& options) {
    auto dealer = open(context, routing_id, options);
    if (!dealer) return dealer.error();
    auto watch = ConnectionWatch::watch(context, *dealer);
    if (!watch) return watch.error();
    const auto connected = connect_socket(dealer->socket_.get(), endpoint);
    if (!connected) return connected.error();
    return WatchedDealer{std::move(*dealer), std::move(*watch)};
}

SendOutcome DealerSocket::send(Frames&& frames) {
    const int error = send_frames(socket_.get(), nullptr, frames);
    if (error == 0) return SendOutcome::delivered;
    CHECK(error == EAGAIN, error, zmq_strerror(error));
    return SendOutcome::would_block;
}

std::optional<Frames> DealerSocket::receive() { return receive_frames(socket_.get()); }

}  // namespace pathscope
