#include "pathscope/net/context.hpp"

#include <zmq.h>

#include <cerrno>

#include "context_state.hpp"
#include "pathscope/core/check.hpp"

namespace pathscope {

Context::Context(const ContextOptions& options) {
    void* context = zmq_ctx_new();
    CHECK(context != nullptr, zmq_strerror(errno));
    CHECK(zmq_ctx_set(context, ZMQ_IO_THREADS, options.io_threads) == 0, options.io_threads);
    CHECK(zmq_ctx_set(context, ZMQ_MAX_SOCKETS, options.max_sockets) == 0, options.max_sockets);
    state_ = std::make_shared<ContextState>(context);
}

ContextState::~ContextState() {
    doorkeeper.reset();
    while (zmq_ctx_term(zmq) != 0 && errno == EINTR) {
    }
}

}  // namespace pathscope
