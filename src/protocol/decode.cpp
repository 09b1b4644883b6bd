#include <fmt/format.h>

#include <array>
#include <limits>
#include <utility>

#include "fields.hpp"
#include "pathscope/protocol/codec.hpp"
#include "pathscope/wire/field_reader.hpp"
#include "pathscope/wire/message_pack.hpp"

namespace pathscope {
namespace {

/// Visitor that fills a message from a header.
class HeaderReader {
  public:
    HeaderReader(const PackMap& map, std::string_view context) : fields(map, std::string(context)) {}

    void u32(std::string_view name, std::uint32_t& value, std::uint32_t least, std::uint32_t most) {
        value = fields.u32(name, least, most);
    }
    void u64(std::string_view name, std::uint64_t& value, std::uint64_t least, std::uint64_t most) {
        value = fields.u64(name, least, most);
    }
    void optional_u32(std::string_view name, std::uint32_t& value, std::uint32_t least, std::uint32_t most,
                      std::uint32_t absent) {
        value = fields.has(name) ? fields.u32(name, least, most) : absent;
    }
    void time(std::string_view name, TimeNs& value) { value = fields.i64(name, 0); }
    void text(std::string_view name, std::string& value, std::size_t least, std::size_t most) {
        value = fields.text(name, least, most);
    }
    void free_text(std::string_view name, std::string& value, std::size_t most) {
        value = fields.text(name, 0, most);
    }
    void bytes(std::string_view name, std::string& value, std::size_t size) {
        value = fields.bytes(name, size, size);
    }
    void hash(std::string_view name, Digest& value) {
        const std::string_view digits = fields.bytes(name, value.size(), value.size());
        if (digits.size() == value.size()) std::copy(digits.begin(), digits.end(), value.begin());
    }
    template <class E>
    void word(std::string_view name, E& value) {
        value = fields.enumerator<E>(name);
    }

    void rect(std::string_view name, PixelRect& rect) {
        const PackArray& items = fields.array(name, 4);
        std::array<int, 4> numbers{};
        if (!read_all(items, numbers, k_max_pixel))
            return fields.fail(name, "is not four integers up to 65536");
        rect = {numbers[0], numbers[1], numbers[2], numbers[3]};
        constexpr int k_side = k_max_pixel;
        if (rect.empty() || rect.x + rect.width > k_side || rect.y + rect.height > k_side)
            fields.fail(name, "is empty or reaches outside of 65536 x 65536");
    }

    void numbers(std::string_view name, std::vector<std::uint64_t>& values, std::size_t most) {
        for (const PackValue& item : fields.array(name, most)) {
            const auto* number = item.get<std::uint64_t>();
            if (!number) return fields.fail(name, "holds something that is no unsigned integer");
            values.push_back(*number);
        }
    }

    void samples(std::string_view name, std::vector<DroppedSample>& values, std::size_t most) {
        for (const PackValue& item : fields.array(name, most)) {
            const auto* triple = item.get<PackArray>();
            std::array<std::uint32_t, 3> n{};
            if (!triple || !read_all(*triple, n, k_max_u32) || n[0] >= k_max_pixel || n[1] >= k_max_pixel)
                return fields.fail(name, "holds something that is no [x, y, sample]");
            values.push_back({n[0], n[1], n[2]});
        }
    }

    void payload(std::string& bytes) { frame = &bytes; }

    FieldReader fields;
    std::string* frame = nullptr;

  private:
    template <class T, std::size_t Size>
    static bool read_all(const PackArray& items, std::array<T, Size>& numbers, std::uint64_t most) {
        if (items.size() != Size) return false;
        for (std::size_t i = 0; i < Size; ++i) {
            const auto* number = items[i].get<std::uint64_t>();
            if (!number || *number > most) return false;
            numbers[i] = static_cast<T>(*number);
        }
        return true;
    }
};

/// A default message of the alternative with this index.
template <std::size_t... Index>
Message make_message(std::size_t index, std::index_sequence<Index...>) {
    Message message;
    (void)((Index == index && (message.emplace<Index>(), true)) || ...);
    return message;
}
static_assert(std::variant_size_v<Message> == k_message_table.size());

bool may_arrive(const MessageInfo& info, Role receiver, Channel channel) {
    const Direction needed = receiver == Role::client ? Direction::to_client : Direction::to_server;
    return info.channel == channel && (info.direction == needed || info.direction == Direction::both);
}

/// The sentence if the frames cannot be this message's, before anything is unpacked.
std::string check_frames(const Frames& frames, const MessageInfo& info) {
    const std::size_t expected = info.payload == "-" ? 2 : 3;
    if (frames.size() != expected)
        return fmt::format("{}: has {} frames, not {}.", info.name, frames.size(), expected);
    if (expected == 3 && frames[2].size() > info.max_payload_bytes)
        return fmt::format("{}: the payload has {} bytes, more than {}.", info.name, frames[2].size(),
                           info.max_payload_bytes);
    return {};
}

Result<Message> read_message(Frames& frames, std::size_t index) {
    const MessageInfo& info = k_message_table[index];
    const auto header = unpack(frames[1], k_header_limits);
    if (!header) return bad_input(fmt::format("{}: {}", info.name, header.error().message));
    const auto* map = header->get<PackMap>();
    if (!map) return bad_input(fmt::format("{}: the header is {}, not a map.", info.name, header->kind()));

    Message message = make_message(index, std::make_index_sequence<std::variant_size_v<Message>>{});
    HeaderReader reader(*map, info.name);
    std::visit(
        [&](auto& m) {
            describe(reader, m);
            if (reader.frame) *reader.frame = std::move(frames[2]);
            const BrokenRule rule = broken_rule(m);
            if (!rule.what.empty()) reader.fields.fail(rule.field, rule.what);
        },
        message);
    if (reader.fields.error()) return *reader.fields.error();
    return message;
}

}  // namespace

Decoded decode(Frames frames, Role receiver, Channel channel) {
    constexpr std::size_t k_unsealed = 4;  // Version 1 had no seal; a peer that speaks it shall be told so.
    const bool sealed = !frames.empty() && frames[0].size() == k_unsealed + k_seal_bytes;
    const bool is_first_version =
        !frames.empty() && frames[0].size() == k_unsealed && frames[0].starts_with("PS\x01");
    if (frames.size() < 2 || !frames[0].starts_with("PS") || !(sealed || is_first_version))
        return DecodeError{DecodeFault::foreign, "This is no message of Pathscope."};
    const auto version = static_cast<std::uint8_t>(frames[0][2]);
    const auto type = static_cast<std::uint8_t>(frames[0][3]);
    const auto error = [&](DecodeFault fault, std::string sentence) {
        return DecodeError{fault, std::move(sentence), version, type};
    };
    if (sealed && frames[0] != message_head(version, type, frames[1]))
        return error(DecodeFault::damaged, "The message was damaged on its way: its seal does not fit.");
    if (version != k_protocol_version)
        return error(
            DecodeFault::version,
            fmt::format(
                "The peer speaks version {} of the protocol, this program version {}; update the older one.",
                version, k_protocol_version));
    const MessageInfo* info = find_message(type);
    if (!info)
        return error(DecodeFault::unknown_type, fmt::format("There is no message of type 0x{:02X}.", type));
    if (!may_arrive(*info, receiver, channel))
        return error(DecodeFault::misplaced,
                     fmt::format("{}: cannot arrive at the {} on {}.", info->name,
                                 receiver == Role::client ? "client" : "server", name_of(channel)));

    std::string wrong = check_frames(frames, *info);
    if (!wrong.empty()) return error(DecodeFault::malformed, std::move(wrong));
    auto message = read_message(frames, static_cast<std::size_t>(info - k_message_table.data()));
    if (!message) return error(DecodeFault::malformed, message.error().message);
    return std::move(*message);
}

}  // namespace pathscope
