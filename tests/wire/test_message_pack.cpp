#include "pathscope/wire/message_pack.hpp"

#include <cmath>
#include <limits>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace std::string_literals;

namespace {

std::string from_hex(std::string_view text) {
    const auto digit = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
    std::string bytes;
    std::string digits;
    for (const char c : text)
        if (c != ' ') digits += c;
    for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
        bytes += static_cast<char>(digit(digits[i]) * 16 + digit(digits[i + 1]));
    return bytes;
}

PackMap map_of(std::string_view key, PackValue value) {
    PackMap map;
    map.set(key, std::move(value));
    return map;
}

/// The sentence, or nothing if the bytes are accepted.
std::string refusal(std::string_view bytes, const PackLimits& limits = k_header_limits) {
    const auto result = unpack(bytes, limits);
    return result ? std::string() : result.error().message;
}

bool contains(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

/// A random number of a random size, so that every length of integer is met.
std::uint64_t random_u64(HashRng& rng) {
    const std::uint64_t bits = std::uint64_t{rng.next_u32()} << 32 | rng.next_u32();
    return bits >> (rng.next_u32() % 64);
}

std::string random_text(HashRng& rng) {
    return std::string(rng.next_u32() % 300, char('a' + rng.next_u32() % 26));
}

PackValue random_value(HashRng& rng, int depth) {
    const std::uint32_t kinds = depth < 7 ? 9 : 7;
    switch (rng.next_u32() % kinds) {
        case 0:
            return PackValue();
        case 1:
            return PackValue(rng.next_u32() % 2 == 0);
        case 2:
            return PackValue(random_u64(rng));
        case 3:
            return PackValue(-static_cast<std::int64_t>(random_u64(rng) >> 1));
        case 4:
            return PackValue(std::ldexp(double(rng.next_float()) - 0.5, int(rng.next_u32() % 200) - 100));
        case 5:
            return PackValue(random_text(rng));
        case 6:
            return PackValue(PackBytes{random_text(rng)});
        case 7: {
            PackArray items(rng.next_u32() % 20);
            for (PackValue& item : items) item = random_value(rng, depth + 3);
            return PackValue(std::move(items));
        }
        default: {
            PackMap map;
            const std::uint32_t size = rng.next_u32() % 20;
            for (std::uint32_t i = 0; i < size; ++i)
                map.set("key" + std::to_string(i), random_value(rng, depth + 3));
            return PackValue(std::move(map));
        }
    }
}

}  // namespace

TEST_CASE("MessagePack bytes are those of its specification") {
    const auto check = [](const PackValue& value, std::string_view hex) {
        CAPTURE(hex);
        CHECK(pack(value) == from_hex(hex));
        const auto back = unpack(from_hex(hex));
        REQUIRE(bool(back));
        CHECK(*back == value);
    };
    check(PackValue(), "c0");
    check(false, "c2");
    check(true, "c3");
    check(0, "00");
    check(127, "7f");
    check(128, "cc 80");
    check(255, "cc ff");
    check(256, "cd 0100");
    check(65535, "cd ffff");
    check(65536, "ce 00010000");
    check(4294967295u, "ce ffffffff");
    check(std::uint64_t{1} << 32, "cf 0000000100000000");
    check(std::numeric_limits<std::uint64_t>::max(), "cf ffffffffffffffff");
    check(-1, "ff");
    check(-32, "e0");
    check(-33, "d0 df");
    check(-128, "d0 80");
    check(-129, "d1 ff7f");
    check(-32768, "d1 8000");
    check(-32769, "d2 ffff7fff");
    check(std::numeric_limits<std::int32_t>::min(), "d2 80000000");
    check(std::numeric_limits<std::int64_t>::min(), "d3 8000000000000000");
    check(1.5, "cb 3ff8000000000000");
    check("", "a0");
    check("abc", "a3 616263");
    check(PackBytes{"\x01\x02"}, "c4 02 0102");
    check(PackBytes{}, "c4 00");
    check(PackArray{1, "a", PackValue()}, "93 01 a161 c0");
    check(PackMap{}, "80");
    // The example on msgpack.org: {"compact":true,"schema":0}.
    PackMap example = map_of("compact", true);
    example.set("schema", 0);
    check(example, "82 a7 636f6d70616374 c3 a6 736368656d61 00");
}

TEST_CASE("a writer says what pack() says of the same value") {
    PackMap map;
    PackArray array;
    PackWriter out;
    out.map(20);
    for (int i = 0; i < 16; ++i) {
        map.set("key" + std::to_string(i), -i);
        out.text("key" + std::to_string(i));
        out.integer(std::int64_t{-i});
    }
    map.set("many", PackArray{PackValue(), true, 1.5, PackBytes{"\x01\x02"}, "text"});
    out.text("many");
    out.array(5);
    out.nil();
    out.boolean(true);
    out.real(1.5);
    out.bytes("\x01\x02");
    out.text("text");
    map.set("none", PackArray{});
    out.text("none");
    out.array(0);
    map.set("large", std::uint64_t{1} << 63);
    out.text("large");
    out.integer(std::uint64_t{1} << 63);
    PackWriter last;
    map.set("last", 7);
    last.text("last");
    last.integer(std::int64_t{7});
    out.append(last);
    const std::size_t size = out.size();
    const std::string said = out.take();
    CHECK(said.size() == size);
    CHECK(said == pack(PackValue(map)));
}

TEST_CASE("lengths take the shortest of their forms") {
    const auto starts = [](const PackValue& value, std::string_view hex) {
        CHECK(pack(value).substr(0, from_hex(hex).size()) == from_hex(hex));
        CHECK(*unpack(pack(value), k_payload_limits) == value);
    };
    starts(std::string(31, 'a'), "bf");
    starts(std::string(32, 'a'), "d9 20");
    starts(std::string(255, 'a'), "d9 ff");
    starts(std::string(256, 'a'), "da 0100");
    starts(std::string(65536, 'a'), "db 00010000");
    starts(PackBytes{std::string(255, 'a')}, "c4 ff");
    starts(PackBytes{std::string(256, 'a')}, "c5 0100");
    starts(PackBytes{std::string(65536, 'a')}, "c6 00010000");
    starts(PackArray(15), "9f");
    starts(PackArray(16), "dc 0010");
    starts(PackArray(65536), "dd 00010000");
    PackMap map;
    for (int i = 0; i < 16; ++i) map.set(std::to_string(i), i);
    starts(map, "de 0010");
}

TEST_CASE("longer forms and 32-bit floats of other writers are understood") {
    CHECK(*unpack(from_hex("cf 0000000000000007")) == PackValue(7));
    CHECK(*unpack(from_hex("d3 0000000000000007")) == PackValue(7));
    CHECK(*unpack(from_hex("d0 07")) == PackValue(7));
    CHECK(*unpack(from_hex("d3 ffffffffffffffff")) == PackValue(-1));
    CHECK(*unpack(from_hex("ca 3fc00000")) == PackValue(1.5));
    CHECK(*unpack(from_hex("db 00000001 61")) == PackValue("a"));
    CHECK(*unpack(from_hex("df 00000001 da0001 61 dd00000000")) == PackValue(map_of("a", PackArray{})));
}

TEST_CASE("a map has a key once, in the order it was set") {
    PackMap map = map_of("a", 1);
    map.set("b", 2);
    map.set("a", 3);
    CHECK(map.size() == 2);
    CHECK(*map.find("a") == PackValue(3));
    CHECK(map.find("c") == nullptr);
    CHECK(map.entries().front().key == "a");
    CHECK(contains(refusal(from_hex("82 a161 01 a161 02")), "a key twice"));
    CHECK_FALSE(PackMap::from_entries({{"a", 1}, {"b", 2}, {"a", 3}}).has_value());
    std::vector<PackEntry> many;
    for (int i = 0; i < 100; ++i) many.push_back({std::to_string(i), i});
    CHECK(PackMap::from_entries(many).has_value());
    many.back().key = "0";
    CHECK_FALSE(PackMap::from_entries(many).has_value());
}

TEST_CASE("what is not of ours is refused with the place") {
    CHECK(contains(refusal(""), "the bytes end inside a value (before byte 0)"));
    CHECK(contains(refusal(from_hex("c0 c0")), "bytes follow the value (before byte 1)"));
    CHECK(contains(refusal(from_hex("c1")), "prefix 0xc1"));
    CHECK(contains(refusal(from_hex("d4 01 02")), "prefix 0xd4"));        // fixext 1
    CHECK(contains(refusal(from_hex("d6 ff 00000000")), "prefix 0xd6"));  // timestamp 32
    CHECK(contains(refusal(from_hex("c7 01 05 00")), "prefix 0xc7"));     // ext 8
    CHECK(contains(refusal(from_hex("81 01 02")), "a key is not text"));
    CHECK(contains(refusal(from_hex("81 90 02")), "a key is not text"));
    CHECK(contains(refusal(from_hex("a1 ff")), "not UTF-8"));
    CHECK(contains(refusal(from_hex("81 a1 ff 00")), "not UTF-8"));
}

TEST_CASE("claims of sizes that are not there build nothing") {
    for (const char* length : {"7fffffff", "80000000", "ffffffff"})
        for (const char* form : {"db", "c6", "dd", "df"}) {
            CAPTURE(form);
            CHECK(contains(refusal(from_hex(form + " "s + length + " 00")), "the bytes end"));
        }
}

TEST_CASE("nesting, elements and bytes have limits") {
    const auto nested = [](std::size_t depth) { return std::string(depth, '\x91') + '\xC0'; };
    CHECK(refusal(nested(8)).empty());
    CHECK(contains(refusal(nested(9)), "nested deeper than 8"));
    CHECK(contains(refusal(nested(60000)), "nested deeper than 8"));

    const auto array_of = [](std::size_t count) { return pack(PackArray(count)); };
    CHECK(refusal(array_of(4095)).empty());
    CHECK(contains(refusal(array_of(4096)), "more than 4096 elements"));
    CHECK(contains(refusal(std::string(100, 'x'), {.max_bytes = 99}), "100 bytes are more than the 99"));
}

TEST_CASE("random values come back, and none of their truncations does") {
    HashRng rng(1);
    for (int i = 0; i < 300; ++i) {
        const PackValue value = random_value(rng, 0);
        const std::string bytes = pack(value);
        const auto back = unpack(bytes, k_payload_limits);
        REQUIRE(bool(back));
        REQUIRE(*back == value);
        REQUIRE(pack(*back) == bytes);
        const std::size_t step = 1 + bytes.size() / 500;
        for (std::size_t size = 0; size < bytes.size(); size += step)
            REQUIRE_FALSE(refusal(std::string_view(bytes).substr(0, size), k_payload_limits).empty());
    }
}

TEST_CASE("mutated bytes never crash, and what is accepted packs again") {
    HashRng rng(2);
    int accepted = 0;
    const int rounds = testing::k_sanitized ? 20'000 : 100'000;
    std::string bytes;
    for (int i = 0; i < rounds; ++i) {
        if (i % 100 == 0) bytes = pack(random_value(rng, 4)) + pack(random_value(rng, 4));
        std::string mutant = bytes;
        for (std::uint32_t flips = 1 + rng.next_u32() % 4; flips-- > 0;)
            mutant[rng.next_u32() % mutant.size()] = static_cast<char>(rng.next_u32());
        mutant.resize(rng.next_u32() % (mutant.size() + 1));
        if (const auto value = unpack(mutant)) {
            ++accepted;
            // NaN differs from itself, so the bytes are compared.
            REQUIRE(pack(*unpack(pack(*value))) == pack(*value));
        }
    }
    CHECK(accepted > 0);
}
