#pragma once
/// The messages, as plain data. docs/protocol.md says what each field means, in which unit, and its limits.
///
/// Every message is absolute and stands for itself: none is relative to one before it. Those that belong to a
/// run of the client carry its session, so that what an earlier run left in a queue is told apart.
/// Why a namespace: a message::Lease is what crosses the wire; the ledger's lease is something else.
/// Thread safety: values.   Test: tests/protocol/test_codec.cpp

#include <array>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "pathscope/core/clock.hpp"
#include "pathscope/core/enum_names.hpp"
#include "pathscope/core/hash.hpp"
#include "pathscope/core/ids.hpp"
#include "pathscope/image/block.hpp"
#include "pathscope/image/dropped_sample.hpp"

namespace pathscope {

enum class RejectCode { version, build, bits, full, banned, malformed, closing };
inline constexpr std::array k_reject_code_names{EnumName<RejectCode>{RejectCode::version, "version"},
                                                EnumName<RejectCode>{RejectCode::build, "build"},
                                                EnumName<RejectCode>{RejectCode::bits, "bits"},
                                                EnumName<RejectCode>{RejectCode::full, "full"},
                                                EnumName<RejectCode>{RejectCode::banned, "banned"},
                                                EnumName<RejectCode>{RejectCode::malformed, "malformed"},
                                                EnumName<RejectCode>{RejectCode::closing, "closing"}};
constexpr const auto& enum_table(RejectCode) { return k_reject_code_names; }

enum class ByeReason { leaving, stop, draining, error };
inline constexpr std::array k_bye_reason_names{
    EnumName<ByeReason>{ByeReason::leaving, "leaving"}, EnumName<ByeReason>{ByeReason::stop, "stop"},
    EnumName<ByeReason>{ByeReason::draining, "draining"}, EnumName<ByeReason>{ByeReason::error, "error"}};
constexpr const auto& enum_table(ByeReason) { return k_bye_reason_names; }

enum class NackCode { state, scene, unsupported, cancelled, busy, memory, draining, failed };
inline constexpr std::array k_nack_code_names{EnumName<NackCode>{NackCode::state, "state"},
                                              EnumName<NackCode>{NackCode::scene, "scene"},
                                              EnumName<NackCode>{NackCode::unsupported, "unsupported"},
                                              EnumName<NackCode>{NackCode::cancelled, "cancelled"},
                                              EnumName<NackCode>{NackCode::busy, "busy"},
                                              EnumName<NackCode>{NackCode::memory, "memory"},
                                              EnumName<NackCode>{NackCode::draining, "draining"},
                                              EnumName<NackCode>{NackCode::failed, "failed"}};
constexpr const auto& enum_table(NackCode) { return k_nack_code_names; }

namespace message {

// ---- monitor

struct Hello {
    std::string instance;  ///< 16 bytes: the routing id of both dealer sockets.
    std::string name;
    std::string version;
    std::string build;
    std::uint32_t threads = 1;
    std::uint32_t pid = 0;
    Digest golden{};
    bool operator==(const Hello&) const = default;
};

struct Welcome {
    std::uint64_t session = 0;
    ServerId server;
    std::uint32_t heartbeat_ms = 250;
    std::uint32_t dead_after_ms = 2000;
    std::uint32_t credits = 2;
    Epoch epoch;
    std::uint64_t sequence = 0;
    Digest state_hash{};
    std::string state;  ///< Payload.
    bool operator==(const Welcome&) const = default;
};

struct Reject {
    RejectCode code = RejectCode::version;
    std::string text;
    std::uint32_t retry_ms = 0;
    bool operator==(const Reject&) const = default;
};

struct Who {
    bool operator==(const Who&) const = default;
};

struct SnapshotRequest {
    std::uint64_t session = 0;
    std::uint64_t have = 0;
    bool operator==(const SnapshotRequest&) const = default;
};

struct Snapshot {
    std::uint64_t session = 0;
    Epoch epoch;
    std::uint64_t sequence = 0;
    Digest state_hash{};
    std::string state;  ///< Payload.
    bool operator==(const Snapshot&) const = default;
};

struct ManifestRequest {
    Digest scene{};
    bool operator==(const ManifestRequest&) const = default;
};

struct Manifest {
    Digest scene{};
    std::string files;  ///< Payload: section 5.2; `scene` is its hash.
    bool operator==(const Manifest&) const = default;
};

struct PieceRequest {
    Digest hash{};
    std::uint64_t offset = 0;
    std::uint32_t length = 1;
    bool operator==(const PieceRequest&) const = default;
};

struct Piece {
    Digest hash{};
    std::uint64_t offset = 0;
    std::uint64_t total = 0;
    std::string bytes;  ///< Payload.
    bool operator==(const Piece&) const = default;
};

struct Ready {
    std::uint64_t session = 0;
    Epoch epoch;
    std::uint64_t sequence = 0;
    Digest state_hash{};
    bool operator==(const Ready&) const = default;
};

struct Ping {
    std::uint64_t token = 0;
    std::uint64_t sequence = 0;
    std::uint64_t progress = 0;
    std::uint32_t queue = 0;
    bool operator==(const Ping&) const = default;
};

struct Pong {
    std::uint64_t token = 0;
    TimeNs received_ns = 0;
    TimeNs sent_ns = 0;
    std::uint64_t progress = 0;
    std::uint32_t queue = 0;
    std::uint32_t at_once = 1;  ///< Leases that the sender works on side by side; may be left out.
    bool operator==(const Pong&) const = default;
};

struct Bye {
    ByeReason reason = ByeReason::leaving;
    std::string text;
    bool operator==(const Bye&) const = default;
};

// ---- input

struct Input {
    std::uint64_t session = 0;
    Epoch epoch;
    std::uint64_t sequence = 0;
    Digest state_hash{};
    std::string changes;  ///< Payload.
    bool operator==(const Input&) const = default;
};

// ---- frames

struct Credit {
    std::uint64_t session = 0;
    std::uint32_t credits = 0;
    LeaseId received{};  ///< The largest lease that reached the server; 0 = none.
    bool operator==(const Credit&) const = default;
};

struct Lease {
    std::uint64_t session = 0;
    LeaseId lease;
    Epoch epoch;
    std::string strategy;
    std::uint32_t unit = 0;
    PixelRect rect;
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    std::uint32_t lease_ms = 0;
    bool operator==(const Lease&) const = default;
};

struct Tile {
    std::uint64_t session = 0;
    LeaseId lease;
    Epoch epoch;
    std::string strategy;
    std::uint32_t unit = 0;
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    std::string codec;
    std::uint32_t raw_bytes = 0;
    Digest hash{};
    std::uint64_t rays = 0;
    std::uint64_t samples = 0;
    TimeNs started_ns = 0;
    TimeNs render_ns = 0;
    std::vector<DroppedSample> dropped;
    std::uint32_t dropped_count = 0;
    std::uint32_t saturated_count = 0;
    std::string result;  ///< Payload.
    bool operator==(const Tile&) const = default;
};

/// The tile that answers a lease, before anything is rendered.
[[nodiscard]] inline Tile make_tile(const Lease& lease) {
    Tile tile;
    tile.session = lease.session;
    tile.lease = lease.lease;
    tile.epoch = lease.epoch;
    tile.strategy = lease.strategy;
    tile.unit = lease.unit;
    tile.first = lease.first;
    tile.count = lease.count;
    return tile;
}

struct Nack {
    std::uint64_t session = 0;
    LeaseId lease;
    Epoch epoch;
    NackCode code = NackCode::failed;
    std::string text;
    bool operator==(const Nack&) const = default;
};

struct Cancel {
    std::uint64_t session = 0;
    Epoch epoch;
    std::vector<std::uint64_t> leases;
    bool operator==(const Cancel&) const = default;
};

}  // namespace message

/// In the order of k_message_table (table.hpp).
using Message =
    std::variant<message::Hello, message::Welcome, message::Reject, message::Who, message::SnapshotRequest,
                 message::Snapshot, message::ManifestRequest, message::Manifest, message::PieceRequest,
                 message::Piece, message::Ready, message::Ping, message::Pong, message::Bye, message::Input,
                 message::Credit, message::Lease, message::Tile, message::Nack, message::Cancel>;

}  // namespace pathscope
