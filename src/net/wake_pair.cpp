#include "pathscope/net/wake_pair.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace pathscope {

Result<WakePair> WakePair::create() {
    int ends[2];
    if (::pipe2(ends, O_NONBLOCK | O_CLOEXEC) != 0)
        return failed(fmt::format("Cannot open a pipe: {}.", std::generic_category().message(errno)));
    return WakePair(ends[0], ends[1]);
}

WakePair::WakePair(WakePair&& other) noexcept
    : read_end_(std::exchange(other.read_end_, -1)), write_end_(std::exchange(other.write_end_, -1)) {}

WakePair& WakePair::operator=(WakePair&& other) noexcept {
    std::swap(read_end_, other.read_end_);
    std::swap(write_end_, other.write_end_);
    return *this;
}

WakePair::~WakePair() {
    if (read_end_ >= 0) ::close(read_end_);
    if (write_end_ >= 0) ::close(write_end_);
}

void WakePair::notify() const noexcept {
    const int saved = errno;  // A signal handler must leave it as it was.
    const char ring = 0;
    // A full pipe has rung already; the only other failure is an interruption.
    while (::write(write_end_, &ring, 1) < 0 && errno == EINTR) {
    }
    errno = saved;
}

void WakePair::clear() noexcept {
    char rings[256];
    for (;;) {
        const auto got = ::read(read_end_, rings, sizeof rings);
        if (got == 0 || (got < 0 && errno != EINTR)) return;
    }
}

}  // namespace pathscope
