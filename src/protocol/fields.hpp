#pragma once
/// The fields of every message, written once.
///
/// describe(field, message) names each field with its type and limits, and then the payload. Four visitors
/// walk it: the one that encodes, the one that decodes, the one that lists fields for the document's test,
/// and the one that prints a line for people. So none of them can forget or misname a field.

#include <concepts>
#include <cstdint>
#include <limits>

#include "pathscope/protocol/message.hpp"
#include "pathscope/protocol/table.hpp"

namespace pathscope {

inline constexpr std::uint32_t k_max_u32 = std::numeric_limits<std::uint32_t>::max();
inline constexpr std::uint64_t k_max_u64 = std::numeric_limits<std::uint64_t>::max();
inline constexpr std::uint32_t k_max_pixel = 65536;
inline constexpr std::uint64_t k_max_file_bytes = std::uint64_t{1} << 40;
inline constexpr std::uint32_t k_max_credits = 1024;
inline constexpr std::uint32_t k_hour_ms = 3'600'000;
inline constexpr std::size_t k_max_text_bytes = 256;

/// M is message type T, const or not: the visitors that read and those that write share a description.
template <class M, class T>
concept Is = std::same_as<std::remove_const_t<M>, T>;

template <class Field, class M>
void describe_session(Field& field, M& m) {
    field.u64("session", m.session, 1, k_max_u64);
}

template <class Field, class M>
void describe_state(Field& field, M& m) {
    field.u32("epoch", m.epoch.value, 0, k_max_u32);
    field.u64("sequence", m.sequence, 0, k_max_u64);
    field.hash("state_hash", m.state_hash);
}

template <class Field, class M>
void describe_lease(Field& field, M& m) {
    describe_session(field, m);
    field.u64("lease", m.lease.value, 1, k_max_u64);
    field.u32("epoch", m.epoch.value, 0, k_max_u32);
}

template <class Field, Is<message::Hello> M>
void describe(Field& field, M& m) {
    field.bytes("instance", m.instance, 16);
    field.text("name", m.name, 1, 64);
    field.text("version", m.version, 1, 32);
    field.text("build", m.build, 1, 64);
    field.u32("threads", m.threads, 1, 65536);
    field.u32("pid", m.pid, 0, k_max_u32);
    field.hash("golden", m.golden);
}

template <class Field, Is<message::Welcome> M>
void describe(Field& field, M& m) {
    describe_session(field, m);
    field.u32("server", m.server.value, 1, k_max_u32);
    field.u32("heartbeat_ms", m.heartbeat_ms, 10, 60'000);
    field.u32("dead_after_ms", m.dead_after_ms, 20, 600'000);
    field.u32("credits", m.credits, 1, k_max_credits);
    describe_state(field, m);
    field.payload(m.state);
}

template <class Field, Is<message::Reject> M>
void describe(Field& field, M& m) {
    field.word("code", m.code);
    field.free_text("text", m.text, k_max_text_bytes);
    field.u32("retry_ms", m.retry_ms, 0, k_hour_ms);
}

template <class Field, Is<message::Who> M>
void describe(Field&, M&) {}

template <class Field, Is<message::SnapshotRequest> M>
void describe(Field& field, M& m) {
    describe_session(field, m);
    field.u64("have", m.have, 0, k_max_u64);
}

template <class Field, Is<message::Snapshot> M>
void describe(Field& field, M& m) {
    describe_session(field, m);
    describe_state(field, m);
    field.payload(m.state);
}

template <class Field, Is<message::ManifestRequest> M>
void describe(Field& field, M& m) {
    field.hash("scene", m.scene);
}

template <class Field, Is<message::Manifest> M>
void describe(Field& field, M& m) {
    field.hash("scene", m.scene);
    field.payload(m.files);
}

template <class Field, Is<message::PieceRequest> M>
void describe(Field& field, M& m) {
    field.hash("hash", m.hash);
    field.u64("offset", m.offset, 0, k_max_file_bytes);
    field.u32("length", m.length, 1, k_max_piece_bytes);
}

template <class Field, Is<message::Piece> M>
void describe(Field& field, M& m) {
    field.hash("hash", m.hash);
    field.u64("offset", m.offset, 0, k_max_file_bytes);
    field.u64("total", m.total, 0, k_max_file_bytes);
    field.payload(m.bytes);
}

template <class Field, Is<message::Ready> M>
void describe(Field& field, M& m) {
    describe_session(field, m);
    describe_state(field, m);
}

template <class Field, Is<message::Ping> M>
void describe(Field& field, M& m) {
    field.u64("token", m.token, 0, k_max_u64);
    field.u64("sequence", m.sequence, 0, k_max_u64);
    field.u64("progress", m.progress, 0, k_max_u64);
    field.u32("queue", m.queue, 0, k_max_u32);
}

template <class Field, Is<message::Pong> M>
void describe(Field& field, M& m) {
    field.u64("token", m.token, 0, k_max_u64);
    field.time("received_ns", m.received_ns);
    field.time("sent_ns", m.sent_ns);
    field.u64("progress", m.progress, 0, k_max_u64);
    field.u32("queue", m.queue, 0, k_max_u32);
    field.optional_u32("at_once", m.at_once, 1, k_max_credits, 1);
}

template <class Field, Is<message::Bye> M>
void describe(Field& field, M& m) {
    field.word("reason", m.reason);
    field.free_text("text", m.text, k_max_text_bytes);
}

template <class Field, Is<message::Input> M>
void describe(Field& field, M& m) {
    describe_session(field, m);
    field.u32("epoch", m.epoch.value, 0, k_max_u32);
    field.u64("sequence", m.sequence, 1, k_max_u64);
    field.hash("state_hash", m.state_hash);
    field.payload(m.changes);
}

template <class Field, Is<message::Credit> M>
void describe(Field& field, M& m) {
    describe_session(field, m);
    field.u32("credits", m.credits, 0, k_max_credits);
    field.u64("received", m.received.value, 0, k_max_u64);
}

template <class Field, Is<message::Lease> M>
void describe(Field& field, M& m) {
    describe_lease(field, m);
    field.text("strategy", m.strategy, 1, 32);
    field.u32("unit", m.unit, 0, k_max_u32);
    field.rect("rect", m.rect);
    field.u32("first", m.first, 0, k_max_u32);
    field.u32("count", m.count, 1, k_max_u32);
    field.u32("lease_ms", m.lease_ms, 1, k_hour_ms);
}

template <class Field, Is<message::Tile> M>
void describe(Field& field, M& m) {
    describe_lease(field, m);
    field.text("strategy", m.strategy, 1, 32);
    field.u32("unit", m.unit, 0, k_max_u32);
    field.u32("first", m.first, 0, k_max_u32);
    field.u32("count", m.count, 1, k_max_u32);
    field.text("codec", m.codec, 1, 32);
    field.u32("raw_bytes", m.raw_bytes, 0, k_max_tile_bytes);
    field.hash("hash", m.hash);
    field.u64("rays", m.rays, 0, k_max_u64);
    field.u64("samples", m.samples, 0, k_max_u64);
    field.time("started_ns", m.started_ns);
    field.time("render_ns", m.render_ns);
    field.samples("dropped", m.dropped, k_max_dropped_listed);
    field.u32("dropped_count", m.dropped_count, 0, k_max_u32);
    field.u32("saturated_count", m.saturated_count, 0, k_max_u32);
    field.payload(m.result);
}

template <class Field, Is<message::Nack> M>
void describe(Field& field, M& m) {
    describe_lease(field, m);
    field.word("code", m.code);
    field.free_text("text", m.text, k_max_text_bytes);
}

template <class Field, Is<message::Cancel> M>
void describe(Field& field, M& m) {
    describe_session(field, m);
    field.u32("epoch", m.epoch.value, 0, k_max_u32);
    field.numbers("leases", m.leases, 1024);
}

/// A rule between two fields that a message breaks, or an empty `what`.
struct BrokenRule {
    std::string_view field, what;
};

template <class M>
BrokenRule broken_rule(const M&) {
    return {};
}

template <class M>
requires Is<M, message::Lease> || Is<M, message::Tile> BrokenRule broken_rule(const M& m) {
    if (m.count > k_max_u32 - m.first) return {"count", "reaches past the last sample number"};
    if constexpr (Is<M, message::Tile>)
        if (m.dropped_count < m.dropped.size())
            return {"dropped_count", "is below the number of samples listed"};
    return {};
}

inline BrokenRule broken_rule(const message::Welcome& m) {
    if (m.dead_after_ms < m.heartbeat_ms) return {"dead_after_ms", "is below heartbeat_ms"};
    return {};
}

inline BrokenRule broken_rule(const message::Piece& m) {
    if (m.offset > m.total || m.bytes.size() > m.total - m.offset) return {"total", "is less than what came"};
    return {};
}

}  // namespace pathscope
