#pragma once
/// Ghosts: thousands of render servers in one process that render nothing.
///
///     GhostConfig config;
///     config.count = 1000;
///     auto host = GhostHost::create(config);
///     (*host)->run();
///
/// A ghost is a ServerMachine like any server's, with a routing id and two sockets of its own: it joins, holds the state,
/// beats, takes leases and answers them. Only what is between a lease and its tile is modelled: the answer comes when a
/// machine of its speed (ghost_speed.hpp) would have it, and its sums are noise. So the bytes are those of a real answer,
/// in size, entropy, hash and range, and the picture means nothing.
/// Why: what a client can stand from a thousand servers is to be measured without the thousand machines. On one core a
/// speed is exact only as long as the sum of all leaves that core time.
/// Two sockets, not three: a ghost has no use for INPUT. It learns from PING's sequence number that it missed a state, and
/// asks for a snapshot, as a server does whose INPUT was lost. Scene files are not fetched.
/// Cost: one thread; a turn of the loop costs what stirred (net/crowd_poller.hpp) and what is due (a priority queue).
/// Thread safety: request_stop() from any thread and from signal handlers; all else from one thread.
/// Test: tests/session/test_ghost_host.cpp

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <queue>
#include <string>
#include <vector>

#include "pathscope/core/clock.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/net/context.hpp"
#include "pathscope/net/crowd_poller.hpp"
#include "pathscope/net/wake_pair.hpp"
#include "pathscope/session/client_config.hpp"
#include "pathscope/session/ghost_speed.hpp"

namespace pathscope {

struct GhostConfig {
    std::string host = "127.0.0.1";  ///< Of the client.
    std::array<int, 3> ports = k_default_ports;
    std::string name = "ghost";  ///< Of the first: "ghost-1".
    int count = 1;
    GhostSpeed speed{};
    std::uint32_t seed = 1;  ///< Of the speeds.
};

class GhostHost {
  public:
    static constexpr int k_most_ghosts = 10'000;

    /// One sentence if the system allows too few open files. Requires: 1 <= count <= k_most_ghosts.
    [[nodiscard]] static Result<std::unique_ptr<GhostHost>> create(GhostConfig config);
    ~GhostHost();

    /// Serves one client after the other. Returns when asked to stop, by request_stop() or all ghosts by the client; an
    /// error if the client refused a ghost for good.
    [[nodiscard]] Result<void> run();

    /// Gives back what is in work, says goodbye. Async-signal-safe.
    void request_stop() noexcept;

  private:
    class Ghost;
    struct Timer {
        TimeNs at;
        std::size_t ghost;
        bool operator>(const Timer& other) const { return at > other.at; }
    };

    GhostHost(GhostConfig config, WakePair wake, CrowdPoller poller);
    void step();
    void tend(std::size_t index);
    void say_goodbye();

    GhostConfig config_;
    Context context_;
    WakePair wake_;
    CrowdPoller poller_;
    std::atomic<bool> stop_requested_{false};
    std::vector<std::unique_ptr<Ghost>> ghosts_;
    std::size_t ended_ = 0;
    std::optional<Error> failure_;
    /// Earliest first. A ghost whose time moved is in it twice; Ghost::planned tells which entry counts.
    std::priority_queue<Timer, std::vector<Timer>, std::greater<>> timers_;
};

}  // namespace pathscope
