#pragma once
/// Messages with random content within every limit, made by walking the fields like encode() does. A field
/// that is added to a message is thereby tested without a change here.

#include <algorithm>
#include <utility>
#include <vector>

#include "../../src/protocol/fields.hpp"
#include "pathscope/math/random.hpp"

namespace pathscope::testing {

class RandomFields {
  public:
    explicit RandomFields(HashRng& rng) : rng_(rng) {}

    void u32(std::string_view, std::uint32_t& value, std::uint32_t least, std::uint32_t most) {
        value = static_cast<std::uint32_t>(number(least, most));
    }
    void u64(std::string_view, std::uint64_t& value, std::uint64_t least, std::uint64_t most) {
        value = number(least, most);
    }
    void optional_u32(std::string_view, std::uint32_t& value, std::uint32_t least, std::uint32_t most,
                      std::uint32_t) {
        value = static_cast<std::uint32_t>(number(least, most));
    }
    void time(std::string_view, TimeNs& value) { value = static_cast<TimeNs>(number(0, k_max_u64 >> 1)); }
    void text(std::string_view, std::string& value, std::size_t least, std::size_t most) {
        value.assign(number(least, most), static_cast<char>('!' + rng_.next_u32() % 90));
    }
    void free_text(std::string_view name, std::string& value, std::size_t most) {
        text(name, value, 0, most);
    }
    void bytes(std::string_view, std::string& value, std::size_t size) { value = random_bytes(size); }
    void hash(std::string_view, Digest& value) {
        for (std::uint8_t& byte : value) byte = static_cast<std::uint8_t>(rng_.next_u32());
    }
    template <class E>
    void word(std::string_view, E& value) {
        const auto& table = enum_table(E{});
        value = table[rng_.next_u32() % table.size()].value;
    }
    void rect(std::string_view, PixelRect& r) {
        r.x = static_cast<int>(number(0, 65535));
        r.y = static_cast<int>(number(0, 65535));
        r.width = static_cast<int>(number(1, 65536u - unsigned(r.x)));
        r.height = static_cast<int>(number(1, 65536u - unsigned(r.y)));
    }
    void numbers(std::string_view, std::vector<std::uint64_t>& values, std::size_t most) {
        values.resize(number(0, most));
        for (std::uint64_t& value : values) value = number(0, k_max_u64);
    }
    void samples(std::string_view, std::vector<DroppedSample>& values, std::size_t most) {
        values.resize(number(0, most));
        for (DroppedSample& s : values)
            s = {std::uint32_t(number(0, 65535)), std::uint32_t(number(0, 65535)), rng_.next_u32()};
    }
    void payload(std::string& bytes) { bytes = random_bytes(number(0, 300)); }

  private:
    /// Often one of the ends, as that is where mistakes are.
    std::uint64_t number(std::uint64_t least, std::uint64_t most) {
        if (rng_.next_u32() % 8 == 0) return least;
        if (rng_.next_u32() % 8 == 0) return most;
        const std::uint64_t bits = std::uint64_t{rng_.next_u32()} << 32 | rng_.next_u32();
        const std::uint64_t small = bits >> (rng_.next_u32() % 64);
        return most - least == k_max_u64 ? small : least + small % (most - least + 1);
    }
    std::string random_bytes(std::size_t size) {
        std::string bytes(size, '\0');
        for (char& byte : bytes) byte = static_cast<char>(rng_.next_u32());
        return bytes;
    }

    HashRng& rng_;
};

/// Repairs what two fields together must obey.
inline void obey_rules(Message& message) {
    const auto within_samples = [](auto& m) {
        m.count = std::max(1u, std::min(m.count, k_max_u32 - m.first));
    };
    if (auto* welcome = std::get_if<message::Welcome>(&message))
        welcome->dead_after_ms = std::max(welcome->dead_after_ms, welcome->heartbeat_ms);
    if (auto* piece = std::get_if<message::Piece>(&message)) {
        piece->offset = std::min(piece->offset, k_max_file_bytes - piece->bytes.size());
        piece->total = std::max<std::uint64_t>(piece->total, piece->offset + piece->bytes.size());
    }
    if (auto* lease = std::get_if<message::Lease>(&message)) {
        lease->first = std::min(lease->first, k_max_u32 - 1);
        within_samples(*lease);
    }
    if (auto* tile = std::get_if<message::Tile>(&message)) {
        tile->first = std::min(tile->first, k_max_u32 - 1);
        within_samples(*tile);
        tile->dropped_count = std::max<std::uint32_t>(tile->dropped_count, tile->dropped.size());
    }
}

template <std::size_t... Index>
std::vector<Message> one_of_each(HashRng& rng, std::index_sequence<Index...>) {
    std::vector<Message> messages{Message(std::in_place_index<Index>)...};
    RandomFields fields(rng);
    for (Message& message : messages) {
        std::visit([&](auto& m) { describe(fields, m); }, message);
        obey_rules(message);
    }
    return messages;
}

/// One message of each type, in the order of the table.
inline std::vector<Message> one_of_each(HashRng& rng) {
    return one_of_each(rng, std::make_index_sequence<std::variant_size_v<Message>>{});
}

/// Who may receive this message.
inline Role receiver_of(const Message& message) {
    return k_message_table[message.index()].direction == Direction::to_client ? Role::client : Role::server;
}
inline Channel channel_of(const Message& message) { return k_message_table[message.index()].channel; }

}  // namespace pathscope::testing
