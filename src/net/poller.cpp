#include "pathscope/net/poller.hpp"

#include <poll.h>
#include <zmq.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "pathscope/core/check.hpp"
#include "zmq_call.hpp"

namespace pathscope {
namespace {

using Items = std::array<zmq_pollitem_t, k_max_pollables>;

/// Rounded up, so that a wait for the next deadline does not end before it and spin.
long to_whole_milliseconds(TimeNs timeout) {
    if (timeout < 0) return -1;
    return static_cast<long>((timeout + k_millisecond_ns - 1) / k_millisecond_ns);
}

short wanted(const Pollable& pollable) { return pollable.to_send ? ZMQ_POLLOUT : ZMQ_POLLIN; }

int poll_items(Items& items, int count, long milliseconds) {
    const int ready = zmq_poll(items.data(), count, milliseconds);
    CHECK(ready >= 0 || errno == EINTR, zmq_strerror(errno));
    return ready;
}

/// For less than ZeroMQ can count. A bell is no promise, and rings once: so ZeroMQ is asked before each wait, and after it.
void poll_shortly(Items& items, std::span<const Pollable> pollables, TimeNs timeout) {
    const TimeNs end = monotonic_now() + timeout;
    std::array<pollfd, k_max_pollables> bells{};
    for (std::size_t i = 0; i < pollables.size(); ++i) {
        const bool writes = pollables[i].to_send && !pollables[i].socket;
        bells[i] = {bell_of(pollables[i]), short(writes ? POLLOUT : POLLIN), 0};
    }
    while (poll_items(items, int(pollables.size()), 0) == 0) {
        const timespec left{0, long(std::max<TimeNs>(end - monotonic_now(), 0))};
        if (left.tv_nsec == 0 || ::ppoll(bells.data(), nfds_t(pollables.size()), &left, nullptr) < 0) return;
    }
}

}  // namespace

Readable wait_readable(std::span<const Pollable> pollables, TimeNs timeout) {
    CHECK(pollables.size() <= k_max_pollables, pollables.size());
    Items items{};
    for (std::size_t i = 0; i < pollables.size(); ++i)
        items[i] = {pollables[i].socket, pollables[i].descriptor, wanted(pollables[i]), 0};

    if (timeout > 0 && timeout < k_millisecond_ns)
        poll_shortly(items, pollables, timeout);
    else
        poll_items(items, int(pollables.size()), to_whole_milliseconds(timeout));
    Readable readable;
    for (std::size_t i = 0; i < pollables.size(); ++i) readable[i] = items[i].revents != 0;
    return readable;
}

}  // namespace pathscope
