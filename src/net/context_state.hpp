#pragma once
/// What a Context and its sockets share.

#include <memory>

#include "doorkeeper.hpp"

namespace pathscope {

class ContextState {
  public:
    explicit ContextState(void* opened) : zmq(opened) {}
    ContextState(const ContextState&) = delete;
    ContextState& operator=(const ContextState&) = delete;
    ~ContextState();

    void* const zmq;                         ///< The ZeroMQ context.
    std::unique_ptr<Doorkeeper> doorkeeper;  ///< Null until admit_only().
};

}  // namespace pathscope
