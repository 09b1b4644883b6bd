#pragma once
/// Messages as a hostile peer writes them: sealed, since whoever forges a message can seal it too, with every field of the
/// document right, wrong, or absent, as the bytes say.
///
/// The fields come from message_fields(), so one that is added to a message is attacked without a change here.

#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pathscope/protocol/codec.hpp"
#include "pathscope/wire/message_pack.hpp"
#include "pathscope/wire/utf8.hpp"

#include "fuzz_input.hpp"

namespace pathscope::fuzz {

inline Frames sealed(std::uint8_t type, std::string header, std::uint8_t version = k_protocol_version) {
    std::string head = message_head(version, type, header);
    return {std::move(head), std::move(header)};
}

inline PackValue any_value(FuzzInput& in, int depth = 0) {
    switch (in.below(depth < 3 ? 9 : 7)) {
        case 0:
            return {};
        case 1:
            return in.flag();
        case 2:
            return in.number();
        case 3:
            return static_cast<std::int64_t>(in.number());
        case 4:
            return static_cast<double>(in.number()) / 256.0;
        case 5:
            return make_printable(in.text(), 255);
        case 6:
            return PackBytes{std::string(in.text())};
        case 7: {
            PackArray items(in.below(6));
            for (PackValue& item : items) item = any_value(in, depth + 1);
            return items;
        }
        default: {
            PackMap map;
            for (std::size_t n = in.below(4); n > 0; --n)
                map.set(std::string(1, char('a' + n)), any_value(in, depth + 1));
            return map;
        }
    }
}

/// The two numbers of "20 to 600000", "16 bytes" or "0 to 64 items"; everything for "any".
inline std::pair<std::uint64_t, std::uint64_t> range_of(const FieldInfo& field) {
    std::uint64_t least = 0, most = field.type == "u32" ? 0xffff'ffff : ~std::uint64_t{0};
    if (field.type == "time") most >>= 1;
    const char* const end = field.limits.data() + field.limits.size();
    const auto first = std::from_chars(field.limits.data(), end, least);
    if (first.ec != std::errc{}) return {0, most};
    const std::size_t to = field.limits.find(" to ");
    if (to == std::string::npos) return {least, least};
    std::from_chars(field.limits.data() + to + 4, end, most);
    return {least, most};
}

/// One of the words of "version, build, full".
inline std::string word_of(std::string_view list, std::size_t pick) {
    for (std::size_t comma = list.find(", "); comma != list.npos && pick > 0; comma = list.find(", "), --pick)
        list.remove_prefix(comma + 2);
    return std::string(list.substr(0, list.find(", ")));
}

/// A value of the field's type and within its limits.
inline PackValue right_value(FuzzInput& in, const FieldInfo& field) {
    const auto [least, most] = range_of(field);
    const auto number = [&in] { return PackValue(in.number()); };
    if (field.type == "u32" || field.type == "u64" || field.type == "time")
        return std::clamp(in.number(), least, most);
    if (field.type == "str") return std::string(std::clamp<std::size_t>(in.byte(), least, most), 'x');
    if (field.type == "bin") {
        std::string bytes(in.text());
        bytes.resize(least);
        return PackBytes{std::move(bytes)};
    }
    if (field.type == "name") return word_of(field.limits, in.byte());
    if (field.type == "rect") return PackArray{number(), number(), number(), number()};
    PackArray items(in.below(4));
    for (PackValue& item : items)
        item = field.type == "u64[]" ? number() : PackArray{number(), number(), number()};
    return items;
}

/// As message_fields(), which writes its list anew each time.
inline const std::vector<FieldInfo>& fields_of(std::size_t message) {
    static const std::vector<std::vector<FieldInfo>> fields = [] {
        std::vector<std::vector<FieldInfo>> all;
        for (const MessageInfo& info : k_message_table) all.push_back(message_fields(info.type));
        return all;
    }();
    return fields[message];
}

/// `session` is what the peer would have to know; most fields of that name hold it.
inline Frames forged_message(FuzzInput& in, std::uint64_t session) {
    const std::size_t message = in.below(k_message_table.size());
    const MessageInfo& info = k_message_table[message];
    PackMap header;
    for (const FieldInfo& field : fields_of(message)) {
        const std::size_t how = in.below(16);
        if (how == 0) header.set(field.name, any_value(in));
        if (how <= 1) continue;
        const bool knows = field.name == "session" && how < 14;
        header.set(field.name, knows ? PackValue(session) : right_value(in, field));
    }
    Frames frames = sealed(std::uint8_t(info.type), pack(PackValue(std::move(header))));
    if (info.max_payload_bytes > 0) frames.emplace_back(in.text());
    return frames;
}

/// Up to three frames of anything.
inline Frames raw_frames(FuzzInput& in) {
    Frames frames(in.below(4));
    for (std::string& frame : frames) frame = in.text();
    return frames;
}

}  // namespace pathscope::fuzz
