#include "pathscope/net/socket.hpp"

#include <zmq.h>

namespace pathscope {

OpenSocket::~OpenSocket() {
    // A monitor that nobody reads any more would block ZeroMQ's own thread with its next event.
    zmq_socket_monitor(socket, nullptr, 0);
    zmq_close(socket);
}

}  // namespace pathscope
