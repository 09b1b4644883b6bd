#include "pathscope/net/poller.hpp"

#include <zmq.h>

#include <array>
#include <cerrno>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

/// Rounded up, so that a wait for the next deadline does not end before it and spin.
long to_whole_milliseconds(TimeNs timeout) {
    if (timeout < 0) return -1;
    return static_cast<long>((timeout + k_millisecond_ns - 1) / k_millisecond_ns);
}

short wanted(const Pollable& pollable) { return pollable.to_send ? ZMQ_POLLOUT : ZMQ_POLLIN; }

}  // namespace

Readable wait_readable(std::span<const Pollable> pollables, TimeNs timeout) {
    CHECK(pollables.size() <= k_max_pollables, pollables.size());
    std::array<zmq_pollitem_t, k_max_pollables> items{};
    for (std::size_t i = 0; i < pollables.size(); ++i)
        items[i] = {pollables[i].socket, pollables[i].descriptor, wanted(pollables[i]), 0};

    const int ready =
        zmq_poll(items.data(), static_cast<int>(pollables.size()), to_whole_milliseconds(timeout));
    CHECK(ready >= 0 || errno == EINTR, zmq_strerror(errno));
    Readable readable;
    for (std::size_t i = 0; i < pollables.size(); ++i) readable[i] = items[i].revents != 0;
    return readable;
}

}  // namespace pathscope
