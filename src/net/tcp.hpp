#pragma once
/// Plain TCP sockets that never block, as far as the chaos relay needs them.
///
/// Everything else in this module speaks ZeroMQ; the relay passes on bytes it does not understand, and so
/// must stand below it. Source: tcp(7), socket(7), getaddrinfo(3).
/// Thread safety: yes, for different sockets.

#include <sys/socket.h>

#include <optional>
#include <string>

#include "descriptor.hpp"
#include "pathscope/core/result.hpp"

namespace pathscope {

struct TcpAddress {
    sockaddr_storage storage{};
    socklen_t size = 0;

    [[nodiscard]] int port() const;
    void set_port(int port);
    [[nodiscard]] bool is_loopback() const;
};

/// The first address of a name, or of digits as in "127.0.0.1" and "::1". May ask a name server, and wait
/// for it.
[[nodiscard]] Result<TcpAddress> resolve_tcp(const std::string& host);

/// Of digits alone, so that no name server is asked; nothing if the host is a name.
[[nodiscard]] std::optional<TcpAddress> tcp_address_of_digits(const std::string& host);

/// Port 0: any free one; tcp_address_of() tells which.
[[nodiscard]] Result<Descriptor> listen_tcp(const TcpAddress& address);
[[nodiscard]] TcpAddress tcp_address_of(const Descriptor& socket);

/// Nothing if no connection waits (or, with errno EMFILE and the like, none can be taken).
[[nodiscard]] Descriptor accept_tcp(const Descriptor& listener);

/// Begins to connect. Once the socket can be written to, tcp_error_of() says whether it stands. Nothing if it
/// failed at once.
[[nodiscard]] Descriptor begin_connect_tcp(const TcpAddress& address);
[[nodiscard]] int tcp_error_of(const Descriptor& socket);  ///< 0, or an errno that has not been told yet.

/// Closes so that the peer sees a reset (RST) instead of an end (FIN): what is under way is lost, at both
/// ends.
void reset_tcp(Descriptor& socket);

}  // namespace pathscope
