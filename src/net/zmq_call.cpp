#include "zmq_call.hpp"

#include <fmt/format.h>

#include <netdb.h>
#include <sys/socket.h>

#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "context_state.hpp"
#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_usual_frames = 4;  ///< Routing id, head, header, payload.

/// Below this, copying a frame is cheaper than giving its memory away.
constexpr std::size_t k_copy_below_bytes = 1024;

/// One zmq_msg_t, closed at the end of its scope unless it was sent.
class OutgoingFrame {
  public:
    explicit OutgoingFrame(const std::string& bytes) { copy(bytes); }

    /// Large frames change owner: ZeroMQ frees the string when the bytes have left, on a thread of its own.
    explicit OutgoingFrame(std::string&& bytes) {
        if (bytes.size() < k_copy_below_bytes) {
            copy(bytes);
            return;
        }
        auto* owned = new std::string(std::move(bytes));
        const auto free_string = [](void*, void* hint) { delete static_cast<std::string*>(hint); };
        CHECK(zmq_msg_init_data(&message_, owned->data(), owned->size(), free_string, owned) == 0, errno);
    }

    OutgoingFrame(const OutgoingFrame&) = delete;
    OutgoingFrame& operator=(const OutgoingFrame&) = delete;
    ~OutgoingFrame() { zmq_msg_close(&message_); }

    /// 0 or an errno.
    int send(void* socket, bool more) {
        for (;;) {
            if (zmq_msg_send(&message_, socket, ZMQ_DONTWAIT | (more ? ZMQ_SNDMORE : 0)) >= 0) return 0;
            if (errno != EINTR) return errno;
        }
    }

  private:
    void copy(std::string_view bytes) {
        CHECK(zmq_msg_init_size(&message_, bytes.size()) == 0, errno, bytes.size());
        if (!bytes.empty()) std::memcpy(zmq_msg_data(&message_), bytes.data(), bytes.size());
    }

    zmq_msg_t message_;
};

class IncomingFrame {
  public:
    IncomingFrame() { zmq_msg_init(&message_); }
    IncomingFrame(const IncomingFrame&) = delete;
    IncomingFrame& operator=(const IncomingFrame&) = delete;
    ~IncomingFrame() { zmq_msg_close(&message_); }

    bool receive(void* socket) {
        for (;;) {
            if (zmq_msg_recv(&message_, socket, ZMQ_DONTWAIT) >= 0) return true;
            if (errno == EINTR) continue;
            CHECK(errno == EAGAIN, errno, zmq_strerror(errno));
            return false;
        }
    }
    bool more() { return zmq_msg_more(&message_) != 0; }
    Origin origin() {
        const auto text = [&](const char* property) {
            const char* value = zmq_msg_gets(&message_, property);
            return std::string(value ? value : "");
        };
        return {text("User-Id"), text("Peer-Address"), zmq_msg_get(&message_, ZMQ_SRCFD)};
    }
    std::string bytes() {
        return {static_cast<const char*>(zmq_msg_data(&message_)), zmq_msg_size(&message_)};
    }

  private:
    zmq_msg_t message_;
};

/// ZeroMQ takes the low 16 bits of a port, so that 99999 would silently mean 34463.
bool has_possible_port(std::string_view endpoint) {
    if (!endpoint.starts_with("tcp://")) return true;
    const std::string_view port = endpoint.substr(endpoint.rfind(':') + 1);
    if (port == "*") return true;
    int number = -1;
    const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
    return error == std::errc() && end == port.data() + port.size() && number >= 0 && number <= 65535;
}

struct SetSecurity {
    void* socket;

    void operator()(std::monostate) const {}
    void operator()(const Listener& listener) const {
        CHECK(is_key(listener.keys.secret_key));
        set_option(socket, ZMQ_CURVE_SERVER, 1);
        set_option(socket, ZMQ_CURVE_SECRETKEY, listener.keys.secret_key);
    }
    void operator()(const Dialler& dialler) const {
        CHECK(is_key(dialler.keys.secret_key) && is_key(dialler.keys.public_key));
        CHECK(is_key(dialler.listener_public_key));
        set_option(socket, ZMQ_CURVE_SERVERKEY, dialler.listener_public_key);
        set_option(socket, ZMQ_CURVE_PUBLICKEY, dialler.keys.public_key);
        set_option(socket, ZMQ_CURVE_SECRETKEY, dialler.keys.secret_key);
    }
};

std::string what_to_do(int error) {
    switch (error) {
        case EADDRINUSE:
            return "it is in use; stop the program that holds it, or choose another port";
        case EACCES:
            return "this user may not; choose a port above 1023";
        case EADDRNOTAVAIL:
        case ENODEV:
            return "this machine has no such address";
        case EINVAL:
        case EPROTONOSUPPORT:
            return "it is no address of the form tcp://HOST:PORT, ipc://PATH or inproc://NAME";
        default:
            return zmq_strerror(error);
    }
}

}  // namespace

void set_option(void* socket, int option, int value) {
    CHECK(zmq_setsockopt(socket, option, &value, sizeof value) == 0, option, value, zmq_strerror(errno));
}

void set_option(void* socket, int option, std::string_view value) {
    CHECK(zmq_setsockopt(socket, option, value.data(), value.size()) == 0, option, zmq_strerror(errno));
}

Result<SocketHandle> open_socket(const Context& context, int type, const SocketOptions& options) {
    if (std::holds_alternative<Listener>(options.security) && !context.state()->doorkeeper)
        return failed("Cannot listen with keys before it is said which keys are admitted.");
    void* socket = zmq_socket(context.state()->zmq, type);
    if (!socket) return failed(fmt::format("Cannot open a socket: {}.", zmq_strerror(errno)));
    SocketHandle handle(context.state(), socket);

    const std::int64_t max_frame_bytes = options.max_frame_bytes;
    CHECK(zmq_setsockopt(socket, ZMQ_MAXMSGSIZE, &max_frame_bytes, sizeof max_frame_bytes) == 0);
    set_option(socket, ZMQ_SNDHWM, options.send_limit);
    set_option(socket, ZMQ_RCVHWM, options.receive_limit);
    set_option(socket, ZMQ_LINGER, options.linger_ms);
    set_option(socket, ZMQ_RECONNECT_IVL, options.reconnect_ms);
    set_option(socket, ZMQ_RECONNECT_IVL_MAX, options.reconnect_max_ms);
    set_option(socket, ZMQ_BACKLOG, options.backlog);
    set_option(socket, ZMQ_HANDSHAKE_IVL, options.handshake_ms);
    set_option(socket, ZMQ_TCP_KEEPALIVE, 1);
    set_option(socket, ZMQ_HEARTBEAT_IVL, options.transport_heartbeat_ms);
    set_option(socket, ZMQ_HEARTBEAT_TIMEOUT, 6 * options.transport_heartbeat_ms);
    std::visit(SetSecurity{socket}, options.security);
    return handle;
}

Result<void> bind_socket(void* socket, const std::string& endpoint) {
    if (has_possible_port(endpoint) && zmq_bind(socket, endpoint.c_str()) == 0) return {};
    const int error = has_possible_port(endpoint) ? errno : EINVAL;
    return bad_input(fmt::format("Cannot listen on {}: {}.", endpoint, what_to_do(error)));
}

Result<void> connect_socket(void* socket, const std::string& endpoint) {
    if (has_possible_port(endpoint) && zmq_connect(socket, endpoint.c_str()) == 0) return {};
    const int error = has_possible_port(endpoint) ? errno : EINVAL;
    return bad_input(fmt::format("Cannot connect to {}: {}.", endpoint, what_to_do(error)));
}

std::string bound_endpoint(void* socket) {
    char text[512];
    std::size_t size = sizeof text;
    CHECK(zmq_getsockopt(socket, ZMQ_LAST_ENDPOINT, text, &size) == 0, zmq_strerror(errno));
    return text;
}

int bell_of(const Pollable& pollable) {
    if (!pollable.socket) return pollable.descriptor;
    int bell = -1;
    std::size_t size = sizeof bell;
    CHECK(zmq_getsockopt(pollable.socket, ZMQ_FD, &bell, &size) == 0, zmq_strerror(errno));
    return bell;
}

int send_frames(void* socket, const std::string* leading, Frames& frames) {
    CHECK(!frames.empty());
    if (leading) {
        if (const int error = OutgoingFrame(*leading).send(socket, true)) return error;
    }
    for (std::size_t i = 0; i < frames.size(); ++i) {
        // The first frame is copied, so that a message that cannot be sent stays whole.
        const bool first = i == 0 && !leading;
        const bool more = i + 1 < frames.size();
        const int error = first ? OutgoingFrame(frames[i]).send(socket, more)
                                : OutgoingFrame(std::move(frames[i])).send(socket, more);
        // Later frames fail only when the connection breaks in between; ZeroMQ then drops the message whole.
        if (error) return first ? error : 0;
    }
    return 0;
}

std::optional<Frames> receive_frames(void* socket, Origin* origin) {
    IncomingFrame incoming;
    if (!incoming.receive(socket)) return std::nullopt;
    Frames frames;
    frames.reserve(k_usual_frames);
    frames.push_back(incoming.bytes());
    // The rest of a message has arrived with its first frame.
    while (incoming.more() && incoming.receive(socket))
        if (frames.size() < k_max_frames) frames.push_back(incoming.bytes());
    // The routing id before a message is made here, and does not always know where the message came from; its end does.
    if (origin) *origin = incoming.origin();
    return frames;
}

namespace {

/// Host and port of one end of a TCP connection: getpeername or getsockname.
using AskEnd = int (*)(int, sockaddr*, socklen_t*);
std::pair<std::string, int> end_of(int descriptor, AskEnd ask) {
    sockaddr_storage address{};
    socklen_t size = sizeof address;
    if (ask(descriptor, reinterpret_cast<sockaddr*>(&address), &size) != 0) return {};
    char host[NI_MAXHOST], port[NI_MAXSERV];
    if (::getnameinfo(reinterpret_cast<sockaddr*>(&address), size, host, sizeof host, port, sizeof port,
                      NI_NUMERICHOST | NI_NUMERICSERV) != 0)
        return {};
    return {host, std::atoi(port)};
}

}  // namespace

std::string peer_of(int descriptor) { return end_of(descriptor, ::getpeername).first; }

void disconnect(const Origin& origin, const std::string& endpoint) {
    if (origin.descriptor < 0 || !endpoint.starts_with("tcp://")) return;
    const int port = std::atoi(endpoint.substr(endpoint.rfind(':') + 1).c_str());
    if (peer_of(origin.descriptor) != origin.address) return;
    if (end_of(origin.descriptor, ::getsockname).second != port) return;
    ::shutdown(origin.descriptor, SHUT_RDWR);
}

}  // namespace pathscope
