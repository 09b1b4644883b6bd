// What a peer may send that is not a message: each is told apart, named, and harmless.

#include <charconv>
#include <map>

#include "pathscope/protocol/codec.hpp"
#include "pathscope/wire/message_pack.hpp"
#include "random_message.hpp"

#include "testing.hpp"

using namespace pathscope;
using testing::channel_of;
using testing::one_of_each;
using testing::receiver_of;

namespace {

Decoded decode_like(const Message& message, Frames frames) {
    return decode(std::move(frames), receiver_of(message), channel_of(message));
}

/// "malformed: TILE: field 'count' is missing.", or nothing if it is accepted.
std::string refusal(const Message& message, Frames frames) {
    const Decoded decoded = decode_like(message, std::move(frames));
    if (decoded) return {};
    return std::string(name_of(decoded.error().fault)) + ": " + decoded.error().sentence;
}

PackMap header_of(const Frames& frames) { return *unpack(frames[1])->get<PackMap>(); }

/// A message whose seal fits, whatever the header.
Frames sealed(std::uint8_t type, std::string header, std::uint8_t version = k_protocol_version) {
    return {message_head(version, type, header), std::move(header)};
}

/// The frames with another header, and the seal that fits it.
Frames with_header(Frames frames, const PackMap& header) {
    Frames other = sealed(std::uint8_t(frames[0][3]), pack(header));
    if (frames.size() == 3) other.push_back(std::move(frames[2]));
    return other;
}

PackMap without(const PackMap& map, std::string_view key) {
    PackMap rest;
    for (const PackEntry& entry : map.entries())
        if (entry.key != key) rest.set(entry.key, entry.value);
    return rest;
}

/// The two numbers in "20 to 600000", "16 bytes" or "0 to 64 items".
std::pair<std::uint64_t, std::uint64_t> read_range(std::string_view limits) {
    std::uint64_t least = 0, most = 0;
    const char* const end = limits.data() + limits.size();
    const char* rest = std::from_chars(limits.data(), end, least).ptr;
    const std::size_t to = limits.find(" to ");
    if (to == std::string_view::npos) return {least, least};
    rest = limits.data() + to + 4;
    std::from_chars(rest, end, most);
    return {least, most};
}

/// Values that a field of this type and these limits must refuse.
std::vector<PackValue> forbidden_values(const FieldInfo& field) {
    std::vector<PackValue> bad{PackValue(), PackMap{}, true, 1.5};
    const auto [least, most] = field.limits == "any" ? std::pair<std::uint64_t, std::uint64_t>{0, k_max_u64}
                                                     : read_range(field.limits);
    if (field.type == "u32" || field.type == "u64" || field.type == "time") {
        bad.insert(bad.end(), {-1, "7"});
        if (least > 0) bad.push_back(least - 1);
        if (field.type == "u32") bad.push_back(std::uint64_t{1} << 32);
        if (field.type == "time") bad.push_back(std::uint64_t{1} << 63);
        if (most < k_max_u64) bad.push_back(most + 1);
    } else if (field.type == "str") {
        bad.insert(bad.end(), {7, PackBytes{"bytes"}, "a\nb", std::string(most + 1, 'x')});
        if (least > 0) bad.push_back(std::string(least - 1, 'x'));
    } else if (field.type == "bin") {
        bad.insert(bad.end(), {"text", PackBytes{std::string(least - 1, 'x')},
                               PackBytes{std::string(least + 1, 'x')}, PackBytes{}});
    } else if (field.type == "name") {
        bad.insert(bad.end(), {7, "", "nonsense", "Version"});
    } else if (field.type == "rect") {
        bad.insert(bad.end(),
                   {PackArray{}, PackArray{0, 0, 1}, PackArray{0, 0, 1, 1, 1}, PackArray{-1, 0, 1, 1},
                    PackArray{0, 0, 0, 1}, PackArray{0, 0, 1, 0}, PackArray{65536, 0, 1, 1},
                    PackArray{1, 0, 65536, 1}, PackArray{0, 1, 1, 65536}, PackArray{0, 0, k_max_u64, 1},
                    PackArray{0, 0, 1, "1"}});
    } else if (field.type == "u64[]") {
        bad.insert(bad.end(), {7, PackArray(most + 1, PackValue(1)), PackArray{-1}, PackArray{"1"}});
    } else if (field.type == "sample[]") {
        bad.insert(bad.end(), {7, PackArray(most + 1, PackValue(PackArray{1, 1, 1})),
                               PackArray{PackArray{1, 1}}, PackArray{PackArray{1, 1, 1, 1}},
                               PackArray{PackArray{65536, 0, 0}}, PackArray{PackArray{0, 65536, 0}},
                               PackArray{PackArray{0, 0, std::uint64_t{1} << 32}}, PackArray{7}});
    } else {
        FAIL("no forbidden values for fields of type " << field.type);
    }
    return bad;
}

}  // namespace

TEST_CASE("each field that is missing is named") {
    HashRng rng(1);
    for (const Message& message : one_of_each(rng)) {
        const Frames frames = encode(message);
        for (const FieldInfo& field : message_fields(type_of(message))) {
            const bool optional = field.limits.find("absent") != std::string::npos;
            const std::string sentence = "malformed: " + std::string(name_of(type_of(message))) +
                                         ": field '" + field.name + "' is missing.";
            CHECK(refusal(message, with_header(frames, without(header_of(frames), field.name))) ==
                  (optional ? "" : sentence));
        }
    }
}

TEST_CASE("each field of a wrong type or beyond its limits is named") {
    HashRng rng(2);
    for (const Message& message : one_of_each(rng)) {
        const Frames frames = encode(message);
        for (const FieldInfo& field : message_fields(type_of(message)))
            for (const PackValue& value : forbidden_values(field)) {
                PackMap header = header_of(frames);
                header.set(field.name, value);
                const std::string start =
                    "malformed: " + std::string(name_of(type_of(message))) + ": field '" + field.name + "' ";
                const std::string sentence = refusal(message, with_header(frames, header));
                CAPTURE(pack(value).substr(0, 20));
                CHECK_MESSAGE(sentence.starts_with(start), start, " ... ", sentence);
            }
    }
}

TEST_CASE("rules between two fields are checked") {
    HashRng rng(3);
    std::map<std::string_view, Message> messages;
    for (Message& message : one_of_each(rng)) messages[name_of(type_of(message))] = std::move(message);
    const auto refuse = [&](std::string_view name,
                            std::initializer_list<std::pair<const char*, PackValue>> changes,
                            std::string_view field) {
        const Message& message = messages[name];
        const Frames frames = encode(message);
        PackMap header = header_of(frames);
        for (const auto& [key, value] : changes) header.set(key, value);
        const std::string sentence = refusal(message, with_header(frames, header));
        CHECK_MESSAGE(sentence.find("field '" + std::string(field) + "' ") != std::string::npos, sentence);
    };
    refuse("WELCOME", {{"heartbeat_ms", 1000}, {"dead_after_ms", 999}}, "dead_after_ms");
    refuse("LEASE", {{"first", k_max_u32}, {"count", 1}}, "count");
    refuse("LEASE", {{"first", 1}, {"count", k_max_u32}}, "count");
    refuse("TILE", {{"first", k_max_u32 - 3}, {"count", 4}}, "count");
    refuse("TILE", {{"dropped", PackArray{PackArray{1, 2, 3}}}, {"dropped_count", 0}}, "dropped_count");

    message::Piece piece;
    piece.bytes = "12345";
    piece.offset = 10;
    piece.total = 15;
    messages["PIECE"] = piece;
    CHECK(refusal(piece, encode(piece)).empty());
    refuse("PIECE", {{"total", 14}}, "total");
    refuse("PIECE", {{"total", 9}}, "total");
}

TEST_CASE("what is not ours, of another version, unknown or misplaced is told apart") {
    const auto fault = [](Frames frames, Role role = Role::client, Channel channel = Channel::monitor) {
        const Decoded decoded = decode(std::move(frames), role, channel);
        REQUIRE_FALSE(bool(decoded));
        return decoded.error().fault;
    };
    const Frames ping = encode(message::Ping{});
    CHECK(fault({}) == DecodeFault::foreign);
    CHECK(fault({""}) == DecodeFault::foreign);
    CHECK(fault({ping[0]}) == DecodeFault::foreign);
    CHECK(fault({"GET / HTTP/1.1", "Host: x"}) == DecodeFault::foreign);
    CHECK(fault({"PT" + ping[0].substr(2), ping[1]}) == DecodeFault::foreign);
    CHECK(fault({ping[0].substr(0, 3), ping[1]}) == DecodeFault::foreign);
    CHECK(fault({ping[0].substr(0, 4), ping[1]}) == DecodeFault::foreign);  // Without its seal.
    CHECK(fault({ping[0] + "x", ping[1]}) == DecodeFault::foreign);
    CHECK(fault({"PS\x01\x0C", ping[1]}) == DecodeFault::version);  // The first version had no seal.
    CHECK(fault(sealed(0x0C, ping[1], 3)) == DecodeFault::version);
    CHECK(fault(sealed(0x0C, ping[1], 0)) == DecodeFault::version);
    CHECK(fault(sealed(0x7F, ping[1])) == DecodeFault::unknown_type);
    CHECK(fault(sealed(0, ping[1])) == DecodeFault::unknown_type);
    CHECK(fault(ping, Role::client, Channel::frames) == DecodeFault::misplaced);
    CHECK(fault(ping, Role::server, Channel::input) == DecodeFault::misplaced);
    CHECK(fault(encode(message::Who{}), Role::client) == DecodeFault::misplaced);
    CHECK(fault(sealed(0x0C, "")) == DecodeFault::malformed);
    CHECK(fault(sealed(0x0C, "\x90")) == DecodeFault::malformed);  // An array, not a map.
    CHECK(fault({ping[0], ping[1], ""}) == DecodeFault::malformed);
    CHECK(fault(sealed(0x0C, std::string((64 << 10) + 1, '\xC0'))) == DecodeFault::malformed);

    const Decoded newer = decode(sealed(1, ping[1], 3), Role::client, Channel::monitor);
    CHECK(newer.error().version == 3);
    CHECK(newer.error().type == 1);
    CHECK(newer.error().sentence.find("version 3") != std::string::npos);
}

TEST_CASE("a message of which any bit of head or header has flipped is damaged, or not ours") {
    HashRng rng(7);
    for (const Message& message : one_of_each(rng)) {
        const Frames frames = encode(message);
        for (std::size_t frame = 0; frame < 2; ++frame)
            for (std::size_t bit = 0; bit < 8 * std::min<std::size_t>(frames[frame].size(), 200); ++bit) {
                Frames flipped = frames;
                flipped[frame][bit / 8] = static_cast<char>(flipped[frame][bit / 8] ^ 1 << bit % 8);
                const Decoded decoded = decode_like(message, std::move(flipped));
                REQUIRE_FALSE(bool(decoded));
                const bool in_magic = frame == 0 && bit < 16;
                CHECK(decoded.error().fault == (in_magic ? DecodeFault::foreign : DecodeFault::damaged));
            }
    }
}

TEST_CASE("both directions of a message that goes both ways are accepted") {
    CHECK(bool(decode(encode(message::Ping{}), Role::client, Channel::monitor)));
    CHECK(bool(decode(encode(message::Ping{}), Role::server, Channel::monitor)));
}

TEST_CASE("a payload beyond its limit, or one that is absent, is refused") {
    HashRng rng(4);
    for (const Message& message : one_of_each(rng)) {
        const MessageInfo& info = k_message_table[message.index()];
        Frames frames = encode(message);
        if (info.max_payload_bytes == 0) {
            frames.push_back("");
            CHECK(refusal(message, frames).find("has 3 frames, not 2") != std::string::npos);
            continue;
        }
        frames.pop_back();
        CHECK(refusal(message, frames).find("has 2 frames, not 3") != std::string::npos);
        frames.push_back(std::string(info.max_payload_bytes + 1, 'x'));
        CHECK(refusal(message, frames).find("the payload has") != std::string::npos);
    }
}

TEST_CASE("every truncation of head and header is refused") {
    HashRng rng(5);
    for (const Message& message : one_of_each(rng)) {
        const Frames frames = encode(message);
        for (std::size_t frame = 0; frame < 2; ++frame) {
            const std::size_t step = 1 + frames[frame].size() / 400;
            for (std::size_t size = 0; size < frames[frame].size(); size += step) {
                Frames cut = frames;
                cut[frame].resize(size);
                CHECK_FALSE(refusal(message, cut).empty());
            }
        }
    }
}

TEST_CASE("random mutations never crash; what is accepted obeys every limit") {
    HashRng rng(6);
    const int rounds = testing::k_sanitized ? 20'000 : 100'000;
    std::vector<Message> messages;
    int accepted = 0, refused = 0;
    for (int i = 0; i < rounds; ++i) {
        if (i % 2000 == 0) messages = one_of_each(rng);
        const Message& message = messages[rng.next_u32() % messages.size()];
        Frames frames = encode(message);
        for (std::uint32_t flips = 1 + rng.next_u32() % 3; flips-- > 0;) {
            std::string& frame = frames[rng.next_u32() % 16 == 0 ? 0 : 1];
            if (frame.empty()) continue;
            frame[rng.next_u32() % frame.size()] = static_cast<char>(rng.next_u32());
        }
        // Whoever forges a message can seal it too.
        frames[0] = message_head(std::uint8_t(frames[0][2]), std::uint8_t(frames[0][3]), frames[1]);
        if (Decoded decoded = decode_like(message, std::move(frames))) {
            ++accepted;
            (void)encode(*decoded);  // CHECKs every limit.
        } else {
            ++refused;
            REQUIRE_FALSE(decoded.error().sentence.empty());
        }
    }
    CHECK(accepted > rounds / 50);
    CHECK(refused > rounds / 50);
}
