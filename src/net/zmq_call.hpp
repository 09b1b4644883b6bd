#pragma once
/// The few ZeroMQ calls that all sockets share. Plain C API: its errors are values, so no exception needs
/// catching.

#include <zmq.h>

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "pathscope/core/frames.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/net/context.hpp"
#include "pathscope/net/socket.hpp"

namespace pathscope {

/// A new socket with the options all types share. Fails when the context has no socket left to give.
[[nodiscard]] Result<SocketHandle> open_socket(const Context& context, int type,
                                               const SocketOptions& options);

void set_option(void* socket, int option, int value);
void set_option(void* socket, int option, std::string_view value);

[[nodiscard]] Result<void> bind_socket(void* socket, const std::string& endpoint);
[[nodiscard]] Result<void> connect_socket(void* socket, const std::string& endpoint);
[[nodiscard]] std::string bound_endpoint(void* socket);

/// The descriptor itself, or the one that ZeroMQ makes readable when something may have happened to its socket.
[[nodiscard]] int bell_of(const Pollable& pollable);

/// Sends all frames as one message, never blocking. Returns 0, or the errno of the first frame, in which case
/// nothing was sent and nothing taken. The leading frame (an address) may be null.
[[nodiscard]] int send_frames(void* socket, const std::string* leading, Frames& frames);

/// Where a message came from, as ZeroMQ tells it.
struct Origin {
    std::string key;      ///< The public key that it entered with; empty without keys.
    std::string address;  ///< Of the machine, as a number; empty if unknown.
    int descriptor = -1;  ///< Of the connection that it came by, which may be closed by now.
};

/// The next message that is waiting; of one with more than k_max_frames, only the first ones are kept.
[[nodiscard]] std::optional<Frames> receive_frames(void* socket, Origin* origin = nullptr);

/// Ends the connection that a message came by; ZeroMQ itself has no way to show a peer of a listening socket out. It
/// keeps no promise that a descriptor is still what it was, so nothing is done unless it leads from that address to our
/// endpoint. At worst another connection between the two is ended, and made anew.
void disconnect(const Origin& origin, const std::string& endpoint);

/// The numeric address of a connection's other end; empty if it is closed.
[[nodiscard]] std::string peer_of(int descriptor);

inline constexpr std::size_t k_max_frames = 16;  ///< More than any message of ours or of ZeroMQ's has.

}  // namespace pathscope
