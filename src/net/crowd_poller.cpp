#include "pathscope/net/crowd_poller.hpp"

#include <fmt/format.h>
#include <sys/epoll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "pathscope/core/check.hpp"
#include "zmq_call.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_named_at_once = 256;  ///< The others are named by the next wait().

}  // namespace

Result<CrowdPoller> CrowdPoller::create() {
    const int descriptor = ::epoll_create1(EPOLL_CLOEXEC);
    if (descriptor < 0)
        return failed(fmt::format("Cannot wait for sockets: {}.", std::generic_category().message(errno)));
    return CrowdPoller(descriptor);
}

CrowdPoller::CrowdPoller(CrowdPoller&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), stirred_(std::move(other.stirred_)) {}

CrowdPoller& CrowdPoller::operator=(CrowdPoller&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    std::swap(stirred_, other.stirred_);
    return *this;
}

CrowdPoller::~CrowdPoller() {
    if (descriptor_ >= 0) ::close(descriptor_);
}

void CrowdPoller::add(const Pollable& pollable, std::uint64_t key) {
    CHECK(!pollable.to_send);
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = key;
    CHECK(::epoll_ctl(descriptor_, EPOLL_CTL_ADD, bell_of(pollable), &event) == 0, errno);
}

void CrowdPoller::remove(const Pollable& pollable) {
    CHECK(::epoll_ctl(descriptor_, EPOLL_CTL_DEL, bell_of(pollable), nullptr) == 0, errno);
}

const std::vector<std::uint64_t>& CrowdPoller::wait(TimeNs timeout) {
    const TimeNs whole_ms = (timeout + k_millisecond_ns - 1) / k_millisecond_ns;
    std::array<epoll_event, k_named_at_once> events;
    const int ready = ::epoll_wait(descriptor_, events.data(), int(events.size()),
                                   timeout < 0 ? -1 : int(std::min<TimeNs>(whole_ms, 1 << 30)));
    CHECK(ready >= 0 || errno == EINTR, errno);
    stirred_.clear();
    for (int i = 0; i < ready; ++i) stirred_.push_back(events[std::size_t(i)].data.u64);
    return stirred_;
}

}  // namespace pathscope
