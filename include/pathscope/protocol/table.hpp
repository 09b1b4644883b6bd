#pragma once
/// One table: which messages there are, who sends them, where, and with what.
///
/// docs/protocol.md shows the same table for people; a test compares the two. Fields are listed by
/// message_fields(), which walks the very description that encode() and decode() walk.
/// Thread safety: yes.   Test: tests/protocol/test_document.cpp, tests/protocol/test_codec.cpp

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pathscope/core/enum_names.hpp"

namespace pathscope {

inline constexpr std::uint8_t k_protocol_version = 2;
inline constexpr std::string_view k_input_topic{"PS\x02", 3};  ///< What a server subscribes to on input.

enum class MessageType : std::uint8_t {
    hello = 0x01,
    welcome = 0x02,
    reject = 0x03,
    who = 0x04,
    snapshot_request = 0x05,
    snapshot = 0x06,
    manifest_request = 0x07,
    manifest = 0x08,
    piece_request = 0x09,
    piece = 0x0A,
    ready = 0x0B,
    ping = 0x0C,
    pong = 0x0D,
    bye = 0x0E,
    input = 0x20,
    credit = 0x30,
    lease = 0x31,
    tile = 0x32,
    nack = 0x33,
    cancel = 0x34,
};

/// One of the three sockets between the client and a server.
enum class Channel { input, monitor, frames };
inline constexpr std::array k_channel_names{EnumName<Channel>{Channel::input, "input"},
                                            EnumName<Channel>{Channel::monitor, "monitor"},
                                            EnumName<Channel>{Channel::frames, "frames"}};
constexpr const auto& enum_table(Channel) { return k_channel_names; }

enum class Role { client, server };

enum class Direction { to_client, to_server, both };
inline constexpr std::array k_direction_names{EnumName<Direction>{Direction::to_client, "S>C"},
                                              EnumName<Direction>{Direction::to_server, "C>S"},
                                              EnumName<Direction>{Direction::both, "both"}};
constexpr const auto& enum_table(Direction) { return k_direction_names; }

struct MessageInfo {
    MessageType type;
    std::string_view name;
    Direction direction;
    Channel channel;
    std::string_view payload;  ///< "-" = none: the message has two frames instead of three.
    std::size_t max_payload_bytes = 0;
};

inline constexpr std::size_t k_max_header_bytes = 64 << 10;
inline constexpr std::size_t k_max_state_bytes = 8 << 20;
inline constexpr std::size_t k_max_piece_bytes = 256 << 10;
inline constexpr std::size_t k_max_tile_bytes = 32 << 20;  ///< A block of 1024 x 1024 is 24 MiB unpacked.

inline constexpr std::array k_message_table{
    MessageInfo{MessageType::hello, "HELLO", Direction::to_client, Channel::monitor, "-"},
    MessageInfo{MessageType::welcome, "WELCOME", Direction::to_server, Channel::monitor, "state",
                k_max_state_bytes},
    MessageInfo{MessageType::reject, "REJECT", Direction::to_server, Channel::monitor, "-"},
    MessageInfo{MessageType::who, "WHO", Direction::to_server, Channel::monitor, "-"},
    MessageInfo{MessageType::snapshot_request, "SNAPSHOT_REQUEST", Direction::to_client, Channel::monitor,
                "-"},
    MessageInfo{MessageType::snapshot, "SNAPSHOT", Direction::to_server, Channel::monitor, "state",
                k_max_state_bytes},
    MessageInfo{MessageType::manifest_request, "MANIFEST_REQUEST", Direction::to_client, Channel::monitor,
                "-"},
    MessageInfo{MessageType::manifest, "MANIFEST", Direction::to_server, Channel::monitor, "manifest",
                k_max_state_bytes},
    MessageInfo{MessageType::piece_request, "PIECE_REQUEST", Direction::to_client, Channel::monitor, "-"},
    MessageInfo{MessageType::piece, "PIECE", Direction::to_server, Channel::monitor, "piece",
                k_max_piece_bytes},
    MessageInfo{MessageType::ready, "READY", Direction::to_client, Channel::monitor, "-"},
    MessageInfo{MessageType::ping, "PING", Direction::both, Channel::monitor, "-"},
    MessageInfo{MessageType::pong, "PONG", Direction::both, Channel::monitor, "-"},
    MessageInfo{MessageType::bye, "BYE", Direction::both, Channel::monitor, "-"},
    MessageInfo{MessageType::input, "INPUT", Direction::to_server, Channel::input, "changes",
                k_max_state_bytes},
    MessageInfo{MessageType::credit, "CREDIT", Direction::to_client, Channel::frames, "-"},
    MessageInfo{MessageType::lease, "LEASE", Direction::to_server, Channel::frames, "-"},
    MessageInfo{MessageType::tile, "TILE", Direction::to_client, Channel::frames, "result", k_max_tile_bytes},
    MessageInfo{MessageType::nack, "NACK", Direction::to_client, Channel::frames, "-"},
    MessageInfo{MessageType::cancel, "CANCEL", Direction::to_server, Channel::frames, "-"},
};

/// The row of a type; null for a byte that is no type.
[[nodiscard]] const MessageInfo* find_message(std::uint8_t type);

[[nodiscard]] std::string_view name_of(MessageType type);

/// The largest frame that may arrive on a channel: what the sockets' max_frame_bytes is set to.
[[nodiscard]] std::size_t max_frame_bytes(Channel channel);

/// A field of a header as the document shows it.
struct FieldInfo {
    std::string name, type, limits;
    bool operator==(const FieldInfo&) const = default;
};

[[nodiscard]] std::vector<FieldInfo> message_fields(MessageType type);

}  // namespace pathscope
