#pragma once
/// How a client session runs: where it listens, which servers it starts, how it hands out work and when it stops.
/// None of this changes a pixel, but for `strategy` and `sampling`; what else does is in render_state.hpp. How many samples
/// a block gets is decided here alone, so that servers need not know the rule.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "pathscope/bvh/tree.hpp"
#include "pathscope/cluster/adaptive.hpp"
#include "pathscope/cluster/audit.hpp"
#include "pathscope/cluster/conduct.hpp"
#include "pathscope/cluster/failure_detector.hpp"
#include "pathscope/cluster/lease_size.hpp"
#include "pathscope/cluster/schedule.hpp"
#include "pathscope/core/clock.hpp"
#include "pathscope/net/security.hpp"
#include "pathscope/protocol/strategy.hpp"

namespace pathscope {

inline constexpr std::array k_default_ports{5555, 5556, 5557};        ///< input, monitor, frames
inline constexpr std::array k_default_relay_ports{6555, 6556, 6557};  ///< The same, where a relay listens.

/// With them, only listed servers come in, and everything is encrypted (net/security.hpp).
struct ClientKeys {
    KeyPair pair;
    std::filesystem::path allow_list;  ///< Of servers' public keys; empty: local servers only.
};

struct ClientConfig {
    std::string host = "127.0.0.1";  ///< Address to bind to.
    std::optional<ClientKeys> keys;
    bool insecure = false;  ///< The user insists on an address that other machines can reach, without keys.
    std::array<int, 3> ports = k_default_ports;
    bool any_ports = false;  ///< Take whichever ports are free; endpoints() tells which.
    bool ports_were_chosen =
        false;  ///< By the user: then a port in use is an error. Else free ones are taken and named.
    bool listens = false;  ///< Sockets are opened even when no local server is asked for.

    int local_servers = 0;  ///< Servers to start as child processes.
    int local_server_threads = 1;
    std::filesystem::path server_program;
    std::string local_server_mesh_cache;  ///< Their --mesh-cache; empty = what they choose themselves.

    bool relaxed = false;  ///< Servers whose bits may differ come in too (admission.hpp), and mark the image.
    int min_servers = 0;   ///< Indirect light waits until so many are ready.
    Strategy strategy = Strategy::blocks;  ///< What the servers compute. A checkpoint holds `blocks` only.
    ScheduleKind schedule = ScheduleKind::pull;
    DetectorKind detector = DetectorKind::adaptive;
    AuditParams audit{};      ///< Without a secret, the session draws one.
    ConductParams conduct{};  ///< How much misconduct of a server is too much.
    UnitOrder order = UnitOrder::spiral;
    int block_size = 32;
    std::uint32_t round_samples = 4;
    TimeNs lease_time =
        k_lease_time;  ///< Of work in one lease, if there is enough (lease_size.hpp); 0 = one round.
    SamplingRule sampling{};

    int threads = 0;                 ///< Of the client's own rendering; 0 = all cores.
    TreeKind tree = TreeKind::wide;  ///< Of the scene that the local servers build.
    TimeNs time_limit = 0;           ///< Stop handing out rounds then; 0 = none.
};

}  // namespace pathscope
