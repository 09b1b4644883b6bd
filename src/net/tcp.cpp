#include "tcp.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>

#include <cerrno>
#include <memory>
#include <system_error>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

constexpr int k_backlog = 4096;
/// The kernel lets a socket hold some twice of it. Left alone it holds up to tens of megabytes, in which a
/// sender would not feel a slow line for long.
constexpr int k_kernel_buffer_bytes = 256 << 10;

std::string why(int error) { return std::generic_category().message(error); }

/// Small messages leave at once: a relay that waits for more would add a delay nobody asked for.
void send_at_once(const Descriptor& socket) {
    const int on = 1;
    ::setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

Descriptor open_tcp(const TcpAddress& address) {
    Descriptor socket(::socket(address.storage.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    // Before the connection stands, as its window is agreed on then; what a listener accepts takes after it.
    for (const int buffer : {SO_SNDBUF, SO_RCVBUF})
        ::setsockopt(socket.get(), SOL_SOCKET, buffer, &k_kernel_buffer_bytes, sizeof k_kernel_buffer_bytes);
    return socket;
}

const sockaddr* generic(const TcpAddress& address) {
    return reinterpret_cast<const sockaddr*>(&address.storage);
}

}  // namespace

int TcpAddress::port() const {
    // The port has the same place in both families.
    return ntohs(reinterpret_cast<const sockaddr_in*>(&storage)->sin_port);
}

void TcpAddress::set_port(int port) {
    reinterpret_cast<sockaddr_in*>(&storage)->sin_port = htons(std::uint16_t(port));
}

bool TcpAddress::is_loopback() const {
    if (storage.ss_family == AF_INET)
        return ntohl(reinterpret_cast<const sockaddr_in*>(&storage)->sin_addr.s_addr) >> 24 == 127;
    return IN6_IS_ADDR_LOOPBACK(&reinterpret_cast<const sockaddr_in6*>(&storage)->sin6_addr);
}

Result<TcpAddress> resolve_tcp(const std::string& host) {
    addrinfo wanted{};
    wanted.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    const int error = ::getaddrinfo(host.c_str(), nullptr, &wanted, &found);
    if (error != 0) return bad_input(fmt::format("There is no host '{}': {}.", host, ::gai_strerror(error)));
    const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);
    TcpAddress address;
    std::memcpy(&address.storage, found->ai_addr, found->ai_addrlen);
    address.size = found->ai_addrlen;
    return address;
}

std::optional<TcpAddress> tcp_address_of_digits(const std::string& host) {
    TcpAddress address;
    auto* const v4 = reinterpret_cast<sockaddr_in*>(&address.storage);
    auto* const v6 = reinterpret_cast<sockaddr_in6*>(&address.storage);
    if (::inet_pton(AF_INET, host.c_str(), &v4->sin_addr) == 1) {
        address.storage.ss_family = AF_INET;
        address.size = sizeof *v4;
    } else if (::inet_pton(AF_INET6, host.c_str(), &v6->sin6_addr) == 1) {
        address.storage.ss_family = AF_INET6;
        address.size = sizeof *v6;
    } else {
        return std::nullopt;
    }
    return address;
}

Result<Descriptor> listen_tcp(const TcpAddress& address) {
    Descriptor socket = open_tcp(address);
    const int on = 1;
    // A port whose old connections are still fading is free for us.
    if (!socket || ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0 ||
        ::bind(socket.get(), generic(address), address.size) != 0 || ::listen(socket.get(), k_backlog) != 0)
        return bad_input(fmt::format("Cannot listen on port {}: {}.", address.port(), why(errno)));
    return socket;
}

TcpAddress tcp_address_of(const Descriptor& socket) {
    TcpAddress address;
    address.size = sizeof address.storage;
    CHECK(::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&address.storage), &address.size) == 0,
          why(errno));
    return address;
}

Descriptor accept_tcp(const Descriptor& listener) {
    Descriptor socket(::accept4(listener.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (socket) send_at_once(socket);
    return socket;
}

Descriptor begin_connect_tcp(const TcpAddress& address) {
    Descriptor socket = open_tcp(address);
    if (!socket) return socket;
    send_at_once(socket);
    if (::connect(socket.get(), generic(address), address.size) != 0 && errno != EINPROGRESS &&
        errno != EINTR)
        return {};
    return socket;
}

int tcp_error_of(const Descriptor& socket) {
    int error = 0;
    socklen_t size = sizeof error;
    ::getsockopt(socket.get(), SOL_SOCKET, SO_ERROR, &error, &size);
    return error;
}

void reset_tcp(Descriptor& socket) {
    const linger now{1, 0};
    if (socket) ::setsockopt(socket.get(), SOL_SOCKET, SO_LINGER, &now, sizeof now);
    socket = {};
}

}  // namespace pathscope
