#include "pathscope/net/connection_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>

#include "zmq_call.hpp"

namespace pathscope {
namespace {

constexpr int k_failed_events = ZMQ_EVENT_HANDSHAKE_FAILED_AUTH | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                                ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL;
constexpr int k_begin_events = ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_CONNECTED;
constexpr int k_watched_events =
    k_begin_events | ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_DISCONNECTED | k_failed_events;
constexpr std::size_t k_max_newcomers = 4096;

RefusalReason reason_of(int event, int value) {
    if (event == ZMQ_EVENT_HANDSHAKE_FAILED_AUTH) return RefusalReason::unlisted_key;
    if (event == ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL) return RefusalReason::broke_off;
    if (value == ZMQ_PROTOCOL_ERROR_ZMTP_CRYPTOGRAPHIC) return RefusalReason::wrong_key;
    if (value == ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH) return RefusalReason::one_sided;
    return RefusalReason::no_zeromq;
}

}  // namespace

Result<ConnectionWatch> ConnectionWatch::watch_handle(const Context& context, const SocketHandle& watched) {
    static std::atomic<unsigned> counter{0};
    const std::string address = fmt::format("inproc://connection-watch-{}", counter++);
    SocketOptions options;
    // ZeroMQ's I/O thread would wait for room in this queue, and everything with it.
    options.send_limit = options.receive_limit = 0;
    auto socket = open_socket(context, ZMQ_PAIR, options);
    if (!socket) return socket.error();
    if (zmq_socket_monitor(watched.get(), address.c_str(), k_watched_events) != 0)
        return failed(fmt::format("Cannot watch the connections of a socket: {}.", zmq_strerror(errno)));
    ConnectionWatch watch;
    watch.watched_ = watched.watched();
    const auto connected = connect_socket(socket->get(), address);
    if (!connected) return connected.error();
    watch.events_ = std::move(*socket);
    return watch;
}

ConnectionWatch& ConnectionWatch::operator=(ConnectionWatch&& other) noexcept {
    ConnectionWatch old(std::move(*this));
    watched_ = std::move(other.watched_);
    events_ = std::move(other.events_);
    newcomers_ = std::move(other.newcomers_);
    failed_ = std::move(other.failed_);
    return *this;
}

ConnectionWatch::~ConnectionWatch() {
    // An event that nobody can read any more would block ZeroMQ's own thread.
    if (const auto watched = watched_.lock()) zmq_socket_monitor(watched->socket, nullptr, 0);
}

ConnectionChanges ConnectionWatch::take_changes() {
    ConnectionChanges changes;
    for (int i = 0; i < 1000; ++i) {
        const auto frames = receive_frames(events_.get());
        if (!frames) break;
        // Number of the event in 16 bits, then a value in 32, both in the order of this machine.
        std::uint16_t event = 0;
        std::int32_t value = 0;
        if (frames->front().size() < sizeof event + sizeof value) continue;
        std::memcpy(&event, frames->front().data(), sizeof event);
        std::memcpy(&value, frames->front().data() + sizeof event, sizeof value);
        take(event, value, changes);
    }
    return changes;
}

void ConnectionWatch::take(int event, int value, ConnectionChanges& changes) {
    if (event & k_begin_events) {
        std::erase_if(newcomers_, [&](const Newcomer& old) { return old.descriptor == value; });
        if (newcomers_.size() >= k_max_newcomers) newcomers_.erase(newcomers_.begin());
        newcomers_.push_back({value, peer_of(value)});
    } else if (event == ZMQ_EVENT_HANDSHAKE_SUCCEEDED) {
        ++changes.accepted;
        // Whose it was is not told. The youngest's: who means well is quick, and who speaks no ZeroMQ lingers.
        if (!newcomers_.empty()) newcomers_.pop_back();
    } else if (event & k_failed_events) {
        failed_.push_back(reason_of(event, value));
    } else if (event == ZMQ_EVENT_DISCONNECTED) {
        on_ended(value, changes);
    }
}

/// A failed handshake ends its connection, and then the descriptor says which one it was. ZeroMQ ends one that does not
/// even begin to speak its language without telling of a failure.
void ConnectionWatch::on_ended(int descriptor, ConnectionChanges& changes) {
    const auto newcomer = std::find_if(newcomers_.begin(), newcomers_.end(),
                                       [&](const Newcomer& one) { return one.descriptor == descriptor; });
    const bool is_newcomer = newcomer != newcomers_.end();
    if (failed_.empty() && !is_newcomer) {
        ++changes.lost;
        return;
    }
    Refusal refusal{RefusalReason::no_zeromq, is_newcomer ? std::move(newcomer->address) : std::string()};
    if (is_newcomer) newcomers_.erase(newcomer);
    if (!failed_.empty()) {
        refusal.reason = failed_.front();
        failed_.pop_front();
    }
    changes.refusals.push_back(std::move(refusal));
}

}  // namespace pathscope
