#pragma once
/// Messages to frames, and back with every check that can be made from the message alone.
///
///     socket.send(peer, encode(message::Who{}));
///
///     Decoded decoded = decode(std::move(frames), Role::client, Channel::monitor);
///     if (!decoded) return count(decoded.error().fault, decoded.error().sentence);
///     std::visit(handler, *decoded);
///
/// Invariant: decode(encode(m)) == m for every m within its limits; whatever else arrives is an error with
/// its kind and one sentence that names message and field ("TILE: field 'count' is missing."), never a crash.
/// Safety: memory is bounded by a small multiple of the bytes received. Payloads are moved, not copied.
/// Thread safety: yes.   Test: tests/protocol/test_codec.cpp, tests/protocol/test_hostile.cpp

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "pathscope/core/check.hpp"
#include "pathscope/core/enum_names.hpp"
#include "pathscope/core/frames.hpp"
#include "pathscope/protocol/message.hpp"
#include "pathscope/protocol/table.hpp"

namespace pathscope {

/// Why a message was dropped: section 8 of docs/protocol.md.
enum class DecodeFault { foreign, damaged, version, unknown_type, misplaced, malformed };
inline constexpr std::array k_decode_fault_names{
    EnumName<DecodeFault>{DecodeFault::foreign, "foreign"},
    EnumName<DecodeFault>{DecodeFault::damaged, "damaged"},
    EnumName<DecodeFault>{DecodeFault::version, "version"},
    EnumName<DecodeFault>{DecodeFault::unknown_type, "unknown_type"},
    EnumName<DecodeFault>{DecodeFault::misplaced, "misplaced"},
    EnumName<DecodeFault>{DecodeFault::malformed, "malformed"}};
constexpr const auto& enum_table(DecodeFault) { return k_decode_fault_names; }

struct DecodeError {
    DecodeFault fault = DecodeFault::foreign;
    std::string sentence;
    std::uint8_t version = 0;  ///< As the head says; 0 when foreign.
    std::uint8_t type = 0;     ///< As the head says; 0 when foreign. A malformed HELLO is answered by REJECT.
};

/// A message, or why it is none.
class [[nodiscard]] Decoded {
  public:
    Decoded(Message message) : content_(std::move(message)) {}
    Decoded(DecodeError error) : content_(std::move(error)) {}

    explicit operator bool() const { return content_.index() == 0; }
    Message& operator*() { return value(); }
    Message* operator->() { return &value(); }
    const DecodeError& error() const {
        CHECK(content_.index() == 1);
        return *std::get_if<DecodeError>(&content_);
    }

  private:
    Message& value() {
        CHECK(content_.index() == 0);
        return *std::get_if<Message>(&content_);
    }
    std::variant<Message, DecodeError> content_;
};

/// Requires: every field within its limits (a field beyond them is a bug of the sender), except that `text`
/// of REJECT, BYE and NACK may be any string: it is made printable and cut.
[[nodiscard]] Frames encode(Message message);

/// `receiver` is the side that decodes, `channel` the socket the frames came from.
[[nodiscard]] Decoded decode(Frames frames, Role receiver, Channel channel);

/// The first frame of a message with that header: "PS", version, type, and the seal, which is the beginning of the hash of
/// these four bytes and the header. A bit that flips on the way to a LEASE would otherwise be rendered.
inline constexpr std::size_t k_seal_bytes = 8;
[[nodiscard]] std::string message_head(std::uint8_t version, std::uint8_t type, std::string_view header);

[[nodiscard]] MessageType type_of(const Message& message);

/// One line for people: "LEASE session=77 lease=501 epoch=3 strategy=blocks ...". Hashes are cut to 8 digits,
/// payloads shown by their size.
[[nodiscard]] std::string to_text(const Message& message);

}  // namespace pathscope
