#pragma once
/// What is counted, by name: one table for the event store, `--stats`, the window and lesson checks.
///
/// Every counter only rises, but for EventStore::take_back. A total exists for the whole run, and one per server (server 0
/// is the client and its own renderer). Test: tests/probe/test_event_store.cpp

#include <cstddef>

#include "pathscope/core/enum_names.hpp"

namespace pathscope {

enum class Counter {
    rounds,            ///< Planned; for an open-ended plan, begun.
    rounds_committed,  ///< Counted into the image, each once.
    leases_granted,
    leases_expired,
    reallocated,          ///< Rounds given again, to another server than the last.
    speculated,           ///< Second leases on a straggler's round.
    duplicates_dropped,   ///< Results of rounds that were committed already.
    stale_dropped,        ///< Results of an old epoch.
    refused_results,      ///< Results that belong to no lease, or not to the lease they name.
    bad_messages,         ///< Malformed, oversized, out of place, unauthorised.
    refused_peers,        ///< Connections turned away before a message of theirs was read.
    nonfinite_dropped,    ///< Samples whose radiance was not finite or negative.
    samples,              ///< Of pixels, merged; rounds_committed counts what they came in.
    tiles,                ///< Results of servers that were merged.
    tile_bytes,           ///< Their payloads as they came...
    tile_bytes_unpacked,  ///< ...and unpacked.
    differing_rounds,     ///< Of `tiles`, those of servers whose bits may differ from the client's.
    rays,
    bytes_in,
    bytes_out,
    messages_in,
    messages_out,
    servers_joined,
    stuck,           ///< How often a server answered heartbeats, but its work stood still.
    died,            ///< 1 for a server that was declared dead; in total, how many.
    rounds_audited,  ///< Rounds that were rendered twice and compared; of the server that gave the first result.
    audits_differing,  ///< Results that an audit found to be false.
    rounds_undone,     ///< Merged rounds that were taken back, since their block held false light.
    banned,            ///< Bans, of servers and of others that misbehaved.
};

inline constexpr std::array k_counter_names{
    EnumName{Counter::rounds, "rounds"},
    EnumName{Counter::rounds_committed, "rounds_committed"},
    EnumName{Counter::leases_granted, "leases_granted"},
    EnumName{Counter::leases_expired, "leases_expired"},
    EnumName{Counter::reallocated, "reallocated"},
    EnumName{Counter::speculated, "speculated"},
    EnumName{Counter::duplicates_dropped, "duplicates_dropped"},
    EnumName{Counter::stale_dropped, "stale_dropped"},
    EnumName{Counter::refused_results, "refused_results"},
    EnumName{Counter::bad_messages, "bad_messages"},
    EnumName{Counter::refused_peers, "refused_peers"},
    EnumName{Counter::nonfinite_dropped, "nonfinite_dropped"},
    EnumName{Counter::samples, "samples"},
    EnumName{Counter::tiles, "tiles"},
    EnumName{Counter::tile_bytes, "tile_bytes"},
    EnumName{Counter::tile_bytes_unpacked, "tile_bytes_unpacked"},
    EnumName{Counter::differing_rounds, "differing_rounds"},
    EnumName{Counter::rays, "rays"},
    EnumName{Counter::bytes_in, "bytes_in"},
    EnumName{Counter::bytes_out, "bytes_out"},
    EnumName{Counter::messages_in, "messages_in"},
    EnumName{Counter::messages_out, "messages_out"},
    EnumName{Counter::servers_joined, "servers_joined"},
    EnumName{Counter::stuck, "stuck"},
    EnumName{Counter::died, "died"},
    EnumName{Counter::rounds_audited, "rounds_audited"},
    EnumName{Counter::audits_differing, "audits_differing"},
    EnumName{Counter::rounds_undone, "rounds_undone"},
    EnumName{Counter::banned, "banned"},
};
constexpr const auto& enum_table(Counter) { return k_counter_names; }

inline constexpr std::size_t k_counters = k_counter_names.size();

/// What is timed, as a distribution per server.
enum class Latency {
    heartbeat,  ///< Round trip of a heartbeat.
    tile,       ///< From granting a lease to committing its result.
};

inline constexpr std::array k_latency_names{
    EnumName{Latency::heartbeat, "heartbeat"},
    EnumName{Latency::tile, "tile"},
};
constexpr const auto& enum_table(Latency) { return k_latency_names; }

inline constexpr std::size_t k_latencies = k_latency_names.size();

}  // namespace pathscope
