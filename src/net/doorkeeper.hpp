#pragma once
/// Answers ZeroMQ's question whether a public key may enter (ZAP, RFC 27), on a thread of its own.

#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "pathscope/core/frames.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/net/security.hpp"
#include "pathscope/net/wake_pair.hpp"

namespace pathscope {

class Doorkeeper {
  public:
    /// One per ZeroMQ context, which must outlive it.
    [[nodiscard]] static Result<std::unique_ptr<Doorkeeper>> start(void* zmq_context);
    ~Doorkeeper();

    void admit_only(const std::vector<std::string>& public_keys);
    [[nodiscard]] bool admits(const std::string& public_key) const;
    [[nodiscard]] std::vector<RefusedKey> take_refused();

  private:
    Doorkeeper(void* socket, WakePair stop);
    void serve();
    [[nodiscard]] Frames answer(const Frames& request);

    void* const socket_;
    WakePair stop_;
    mutable std::mutex mutex_;
    std::set<std::string> admitted_;
    std::vector<RefusedKey> refused_;
    std::thread thread_;
};

}  // namespace pathscope
