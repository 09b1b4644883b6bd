#include "pathscope/protocol/block_result.hpp"

#include "pathscope/core/hash.hpp"
#include "pathscope/math/random.hpp"
#include "pathscope/protocol/codec.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

std::vector<PixelSum> some_sums(std::size_t pixels) {
    HashRng rng(1);
    std::vector<PixelSum> sums(pixels);
    for (PixelSum& sum : sums)
        sum = {rng.next_u32() & 0xFFFFFF, rng.next_u32() & 0xFFFFFF, rng.next_u32() & 0xFFFFFF};
    return sums;
}

message::Tile tile_of(const std::vector<PixelSum>& sums, Codec codec = Codec::shuffle_zstd) {
    message::Tile tile;
    tile.session = 1;
    tile.lease = LeaseId{1};
    tile.strategy = k_blocks_strategy;
    tile.count = 4;
    put_block_result(tile, sums, codec);
    return tile;
}

std::string refusal(const message::Tile& tile, std::int64_t pixels) {
    const auto sums = block_result(tile, pixels);
    return sums ? std::string() : sums.error().message;
}

}  // namespace

TEST_CASE("sums of a block come back, over the wire, with each codec") {
    for (const std::size_t pixels : {0, 1, 32 * 32, 17 * 5})
        for (const Codec codec : {Codec::raw, Codec::shuffle_zstd}) {
            const auto sums = some_sums(pixels);
            Decoded arrived = decode(encode(tile_of(sums, codec)), Role::client, Channel::frames);
            REQUIRE(bool(arrived));
            const auto back = block_result(std::get<message::Tile>(*arrived), std::int64_t(pixels));
            REQUIRE(bool(back));
            CHECK(*back == sums);
        }
}

TEST_CASE("the bytes before packing are the document's: red, green, blue, little-endian") {
    const message::Tile tile = tile_of({{1, 2, 256}, {3, 0, 0}}, Codec::raw);
    CHECK(tile.codec == "raw");
    CHECK(tile.raw_bytes == 48);
    std::string expected(48, '\0');
    expected[0] = 1;
    expected[8] = 2;
    expected[17] = 1;
    expected[24] = 3;
    CHECK(tile.result == expected);
    CHECK(tile.hash == hash_text(expected));
}

TEST_CASE("a tile whose codec, size, hash or range is wrong is refused with a sentence") {
    const auto sums = some_sums(64);
    const message::Tile good = tile_of(sums);
    REQUIRE(good.codec == "shuffle-zstd");
    REQUIRE(refusal(good, 64).empty());

    message::Tile bad = good;
    bad.codec = "zip";
    CHECK(refusal(bad, 64) == "TILE: codec 'zip' is not known.");
    CHECK(refusal(good, 63).find("'raw_bytes' is 1536, but 63 pixels have 1512") != std::string::npos);
    for (const std::uint32_t claim : {0u, 1u, 1u << 31, ~0u}) {
        bad = good;
        bad.raw_bytes = claim;
        CHECK(refusal(bad, 64).find("'raw_bytes' is") != std::string::npos);
    }
    bad = good;
    bad.hash[0] ^= 1;
    CHECK(refusal(bad, 64).find("'hash'") != std::string::npos);
    bad = good;
    bad.codec = "raw";
    CHECK(refusal(bad, 64).find("payload has") != std::string::npos);

    // A frame has a few bits without a meaning, but the hash is of the bytes that travel: not one may flip.
    for (std::size_t i = 0; i < good.result.size(); ++i) {
        bad = good;
        bad.result[i] = static_cast<char>(bad.result[i] ^ 0x10);
        CHECK(refusal(bad, 64).find("'hash'") != std::string::npos);
    }
}

TEST_CASE("a payload whose hash fits and which does not unpack is refused by its codec") {
    const message::Tile good = tile_of(some_sums(64));
    const auto with = [&](std::string payload) {
        message::Tile bad = good;
        bad.result = std::move(payload);
        bad.hash = hash_text(bad.result);
        return refusal(bad, 64);
    };
    REQUIRE(with(good.result).empty());
    CHECK(with("").find("TILE: ") == 0);
    CHECK(with(good.result.substr(0, good.result.size() - 1)).find("TILE: ") == 0);
    CHECK(with(good.result + good.result).find("exactly one") != std::string::npos);
    CHECK(with(tile_of(some_sums(65)).result).find("does not state") != std::string::npos);
}

TEST_CASE("lossy tiles come back within their error, and only where they were asked for") {
    for (const WireFormat format : {WireFormat::half, WireFormat::shared})
        for (const std::size_t pixels : {0, 1, 32 * 32, 17 * 5}) {
            const auto sums = some_sums(pixels);
            message::Tile tile = tile_of(sums);
            put_block_result(tile, sums, format);
            CHECK(tile.raw_bytes == wire_bytes(format, pixels));
            CHECK(tile.codec.starts_with(name_of(format)));
            Decoded arrived = decode(encode(tile), Role::client, Channel::frames);
            REQUIRE(bool(arrived));
            const auto& there = std::get<message::Tile>(*arrived);
            const auto back = block_result(there, std::int64_t(pixels), format);
            REQUIRE_MESSAGE(bool(back), back.error().message);
            for (std::size_t i = 0; i < pixels; ++i) {
                const std::int64_t largest = std::max({sums[i].r, sums[i].g, sums[i].b});
                CHECK(std::abs((*back)[i].g - sums[i].g) * 512 <= largest);
            }
            CHECK(refusal(there, std::int64_t(pixels)).find("loses bits") != std::string::npos);
            CHECK(
                bool(block_result(tile_of(sums), std::int64_t(pixels), format)));  // Exact is always welcome.
        }
}

TEST_CASE("a lossy tile that claims another size, or hides a bomb, is refused") {
    const auto sums = some_sums(64);
    message::Tile good = tile_of(sums);
    put_block_result(good, std::vector<PixelSum>(64, {5, 6, 7}), WireFormat::half);
    REQUIRE(good.codec == "half-zstd");
    const auto refusal_of = [](const message::Tile& tile, std::int64_t pixels) {
        const auto back = block_result(tile, pixels, WireFormat::half);
        return back ? std::string() : back.error().message;
    };
    REQUIRE(refusal_of(good, 64).empty());
    CHECK(refusal_of(good, 63).find("'raw_bytes' is 385, but 63 pixels have 379") != std::string::npos);
    for (const std::uint32_t claim : {0u, 1u, 1u << 31, ~0u}) {
        message::Tile bad = good;
        bad.raw_bytes = claim;
        CHECK(refusal_of(bad, 64).find("'raw_bytes' is") != std::string::npos);
    }
    message::Tile bomb = good;
    bomb.result = pack_bytes(Codec::zstd, std::string(16 << 20, '\0')).bytes;
    bomb.hash = hash_text(bomb.result);
    CHECK(refusal_of(bomb, 64).find("does not state") != std::string::npos);
    message::Tile infinite = good;
    infinite.codec = "half";
    infinite.result = std::string(385, '\x7c');
    infinite.result[0] = 0;
    infinite.hash = hash_text(infinite.result);
    CHECK(refusal_of(infinite, 64).find("not a number") != std::string::npos);
}

TEST_CASE("sums that no samples can add up to are refused, so that adding cannot overflow") {
    const std::int64_t most = 4 * k_max_quanta;
    CHECK(refusal(tile_of({{most, most, most}}), 1).empty());
    CHECK(refusal(tile_of({{most + 1, 0, 0}}), 1).find("beyond what 4 samples") != std::string::npos);
    CHECK(refusal(tile_of({{0, -1, 0}}), 1).find("beyond what 4 samples") != std::string::npos);
}
