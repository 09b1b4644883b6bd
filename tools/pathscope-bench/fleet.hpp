#pragma once
/// A client in this process, and servers in others: how long a frame takes them.
///
/// The client waits until all servers are ready, then the clock runs until the frame is complete. Light is indirect alone,
/// so that nothing is rendered in this process.

#include <cstdint>
#include <filesystem>

#include "pathscope/core/result.hpp"
#include "pathscope/session/client_session.hpp"
#include "pathscope/session/ghost_speed.hpp"

namespace pathscope::bench {

/// Who serves.
struct Fleet {
    int servers = 1;
    bool ghosts = true;  ///< One process of ghosts; else as many processes that render.
    GhostSpeed speed{};  ///< Of ghosts.
    std::uint32_t speed_seed = 1;
    double speed_cap = 0;  ///< Of processes that render, in samples per second; 0 = none.

    [[nodiscard]] double samples_per_second() const;  ///< Of all together. Requires: not unlimited.
};

struct FrameFigures {
    double join_s = 0;         ///< From the start of the servers' processes until all were ready.
    double render_s = 0;       ///< From then until the frame was complete.
    double main_cpu_s = 0;     ///< Processor time of the client's main thread meanwhile.
    double process_cpu_s = 0;  ///< And of its network thread.
    double samples = 0;
    std::uint64_t tiles = 0;
    std::uint64_t leases = 0;   ///< That were granted for them: more where some were lost, late or copied.
    double kib_per_server = 0;  ///< By which the client's memory grew, until the frame was complete.
};

/// An error if a server does not join or the frame does not end.
[[nodiscard]] Result<FrameFigures> render_frame(ClientConfig config, const ClientJob& job,
                                                const Fleet& fleet);

/// The same without servers, in this process. Processor times are of all threads.
[[nodiscard]] Result<FrameFigures> render_frame_alone(ClientConfig config, const ClientJob& job);

}  // namespace pathscope::bench
