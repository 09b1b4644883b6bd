#include "pathscope/net/publisher.hpp"

#include "context_state.hpp"
#include "pathscope/core/check.hpp"
#include "zmq_call.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_max_subscribers = 8192;

}  // namespace

Result<PublisherSocket> PublisherSocket::bind(const Context& context, const std::string& endpoint,
                                              const SocketOptions& options) {
    auto socket = open_socket(context, ZMQ_XPUB, options);
    if (!socket) return socket.error();
    set_option(socket->get(), ZMQ_XPUB_VERBOSER, 1);  // Every subscription, not only the first of each topic.
    const auto bound = bind_socket(socket->get(), endpoint);
    if (!bound) return bound.error();

    PublisherSocket publisher;
    publisher.endpoint_ = bound_endpoint(socket->get());
    publisher.has_keys_ = std::holds_alternative<Listener>(options.security);
    publisher.socket_ = std::move(*socket);
    return publisher;
}

void PublisherSocket::publish(Frames&& frames) {
    const int error = send_frames(socket_.get(), nullptr, frames);
    CHECK(error == 0, zmq_strerror(error));  // An XPUB drops for slow subscribers; it has no other trouble.
}

int PublisherSocket::count_subscriptions() {
    for (int i = 0; i < 1000; ++i) {
        Origin origin;
        const auto frames = receive_frames(socket_.get(), &origin);
        if (!frames) break;
        // ZeroMQ RFC 29: a byte, 1 to subscribe and 0 to unsubscribe, then the topic.
        if (frames->front().starts_with('\1')) {
            ++subscriptions_;
            if (has_keys_) remember({origin.key, origin.address, origin.descriptor});
        }
        if (frames->front().starts_with('\0') && subscriptions_ > 0) --subscriptions_;
    }
    return subscriptions_;
}

void PublisherSocket::remember(Subscriber subscriber) {
    std::erase(subscribers_, subscriber);
    if (subscribers_.size() >= k_max_subscribers) subscribers_.pop_front();
    subscribers_.push_back(std::move(subscriber));
}

void PublisherSocket::disconnect_unlisted() {
    if (!has_keys_) return;
    count_subscriptions();
    std::erase_if(subscribers_, [this](const Subscriber& subscriber) {
        if (socket_.context().doorkeeper->admits(subscriber.key)) return false;
        disconnect({subscriber.key, subscriber.address, subscriber.descriptor}, endpoint_);
        return true;
    });
}

}  // namespace pathscope
