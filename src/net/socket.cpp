#include "pathscope/net/socket.hpp"

#include <zmq.h>

namespace pathscope {

SocketHandle::SocketHandle(SocketHandle&& other) noexcept
    : context_(std::move(other.context_)), socket_(std::exchange(other.socket_, nullptr)) {}

SocketHandle& SocketHandle::operator=(SocketHandle&& other) noexcept {
    // The old socket must close before the context that it may have been the last to hold.
    SocketHandle old(std::move(*this));
    context_ = std::move(other.context_);
    socket_ = std::exchange(other.socket_, nullptr);
    return *this;
}

SocketHandle::~SocketHandle() {
    if (socket_) zmq_close(socket_);
}

}  // namespace pathscope
