#include "chaos_connection.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <cerrno>

namespace pathscope {
namespace {

bool later(int error) { return error == EAGAIN || error == EWOULDBLOCK || error == EINTR; }

}  // namespace

ChaosConnection::ChaosConnection(Descriptor dialler, Descriptor target, std::uint64_t seed,
                                 std::size_t buffer_bytes)
    : ends_{std::move(dialler), std::move(target)},
      directions_{Direction{ChaosStream(seed, buffer_bytes)},
                  Direction{ChaosStream(seed + 1, buffer_bytes)}} {
    directions_[0].blocked = true;
}

void ChaosConnection::set_faults(std::size_t direction, const ChaosFaults& faults, TimeNs now) {
    directions_[direction].stream.set_faults(faults, now);
}

void ChaosConnection::half_close(std::size_t direction, TimeNs now) {
    directions_[direction].stream.end(now);
}

std::array<pollfd, 2> ChaosConnection::polls() const {
    std::array<pollfd, 2> polls{};
    for (std::size_t end = 0; end < 2; ++end) {
        const Direction &from = directions_[end], &to = directions_[1 - end];
        short events = 0;
        const bool stands = end == 0 || !connecting_;
        if (stands && !from.input_over && from.stream.room() > 0) events |= POLLIN;
        if (to.blocked) events |= POLLOUT;
        // A socket whose two directions are over would hang up at each wait, asked or not.
        const bool hangs_up = events == 0 && to.output_over;
        polls[end] = {hangs_up ? -1 : ends_[end].get(), events, 0};
    }
    return polls;
}

std::optional<TimeNs> ChaosConnection::next_due(TimeNs now) const {
    std::optional<TimeNs> earliest;
    for (const Direction& direction : directions_) {
        if (direction.blocked || direction.output_over) continue;
        const auto due = direction.stream.next_due(now);
        if (due && (!earliest || *due < *earliest)) earliest = due;
    }
    return earliest;
}

void ChaosConnection::step(std::span<const pollfd, 2> polled, std::span<std::byte> scratch, TimeNs now) {
    if (connecting_ && polled[1].revents != 0) finish_connecting();
    for (std::size_t end = 0; end < 2 && ending_ == ChaosEnding::none; ++end) {
        if (polled[end].revents & POLLERR) return reset(ChaosEnding::reset);
        if (polled[end].revents & POLLOUT) directions_[1 - end].blocked = false;
        if (polled[end].revents & (POLLIN | POLLHUP)) read_from(end, scratch, now);
    }
    // What was read just now may be due just now.
    for (std::size_t direction = 0; direction < 2 && ending_ == ChaosEnding::none; ++direction)
        write_to(direction, now);
    if (ending_ == ChaosEnding::none && directions_[0].output_over && directions_[1].output_over) close();
}

void ChaosConnection::close() {
    ends_ = {};
    for (Direction& direction : directions_) direction.stream.abandon();
    ending_ = ChaosEnding::closed;
}

void ChaosConnection::finish_connecting() {
    if (tcp_error_of(ends_[1]) != 0) return reset(ChaosEnding::unreachable);
    connecting_ = false;
}

void ChaosConnection::read_from(std::size_t direction, std::span<std::byte> scratch, TimeNs now) {
    Direction& d = directions_[direction];
    const std::size_t count = std::min(scratch.size(), d.stream.room());
    if (d.input_over || count == 0) return;
    const ssize_t got = ::recv(ends_[direction].get(), scratch.data(), count, 0);
    if (got > 0) {
        d.stream.push(scratch.first(std::size_t(got)), now);
    } else if (got == 0) {
        d.input_over = true;
        d.stream.end(now);
    } else if (!later(errno)) {
        reset(ChaosEnding::reset);
    }
}

void ChaosConnection::write_to(std::size_t direction, TimeNs now) {
    Direction& d = directions_[direction];
    if (d.output_over || d.blocked) return;
    const int receiver = ends_[1 - direction].get();
    for (auto bytes = d.stream.ready(now); !bytes.empty(); bytes = d.stream.ready(now)) {
        const ssize_t sent = ::send(receiver, bytes.data(), bytes.size(), MSG_NOSIGNAL);
        if (sent < 0) {
            d.blocked = later(errno);
            if (!d.blocked) reset(ChaosEnding::reset);
            return;
        }
        d.stream.pop(std::size_t(sent), now);
    }
    if (d.stream.finished(now)) {
        ::shutdown(receiver, SHUT_WR);
        d.output_over = true;
    }
}

void ChaosConnection::reset(ChaosEnding ending) {
    for (Descriptor& end : ends_) reset_tcp(end);
    for (Direction& direction : directions_) direction.stream.abandon();
    ending_ = ending;
}

}  // namespace pathscope
