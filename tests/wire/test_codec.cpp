#include "pathscope/wire/codec.hpp"

#include <zstd.h>

#include <cstdint>
#include <cstring>
#include <vector>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

std::string random_bytes(HashRng& rng, std::size_t size) {
    std::string bytes(size, '\0');
    for (char& byte : bytes) byte = static_cast<char>(rng.next_u32());
    return bytes;
}

/// Words as a tile has them: positive, far from filling 64 bits.
std::string tile_like_bytes(HashRng& rng, std::size_t words) {
    std::string bytes(words * 8, '\0');
    for (std::size_t i = 0; i < words; ++i) {
        const std::uint64_t word = (std::uint64_t{1} << 30) + rng.next_u32() % 100'000;
        std::memcpy(bytes.data() + i * 8, &word, 8);
    }
    return bytes;
}

/// A Zstandard frame of any content, as a hostile peer would write it.
std::string frame_of(const std::string& content) {
    std::string frame(ZSTD_compressBound(content.size()), '\0');
    frame.resize(ZSTD_compress(frame.data(), frame.size(), content.data(), content.size(), 19));
    return frame;
}

}  // namespace

TEST_CASE("codec names go both ways") {
    for (const auto& entry : k_codec_names) {
        CHECK(name_of(entry.value) == entry.name);
        CHECK(from_name<Codec>(entry.name) == entry.value);
    }
    CHECK_FALSE(from_name<Codec>("lz4").has_value());
}

TEST_CASE("bytes of any size come back from every codec") {
    HashRng rng(3);
    for (const auto& entry : k_codec_names)
        for (const std::size_t size : {0, 1, 7, 8, 9, 16, 24, 1000, 24'576}) {
            CAPTURE(entry.name);
            CAPTURE(size);
            for (const std::string& bytes : {random_bytes(rng, size), std::string(size, 'x')}) {
                const PackedBytes packed = pack_bytes(entry.value, bytes);
                CHECK(packed.bytes.size() <= size);
                const auto back = unpack_bytes(packed.codec, packed.bytes, size);
                REQUIRE(bool(back));
                CHECK(*back == bytes);
            }
        }
}

TEST_CASE("shuffle-zstd makes sums of a tile at most a third, and never sends more than raw") {
    HashRng rng(4);
    const std::string tile = tile_like_bytes(rng, 3 * 32 * 32);
    const PackedBytes packed = pack_bytes(Codec::shuffle_zstd, tile);
    CHECK(packed.codec == Codec::shuffle_zstd);
    CHECK(packed.bytes.size() * 3 <= tile.size());
    CHECK(pack_bytes(Codec::shuffle_zstd, random_bytes(rng, 4096)).codec == Codec::raw);
}

TEST_CASE("the planes lie as the document says: all first bytes, then all second ones") {
    std::string words;
    for (int i = 0; i < 64; ++i) words += {char(i), 1, 2, 3, 4, 5, 6, 7};
    const PackedBytes packed = pack_bytes(Codec::shuffle_zstd, words);
    REQUIRE(packed.codec == Codec::shuffle_zstd);
    std::string planes(512, '\0');
    REQUIRE(ZSTD_decompress(planes.data(), planes.size(), packed.bytes.data(), packed.bytes.size()) == 512);
    for (int i = 0; i < 64; ++i) CHECK(planes[i] == char(i));
    for (int i = 64; i < 512; ++i) CHECK(planes[i] == char(i / 64));
}

TEST_CASE("another size than expected is refused, and bombs before they unpack") {
    const std::string bomb = frame_of(std::string(64 << 20, '\0'));
    REQUIRE(bomb.size() < 8192);
    for (const std::size_t expected : {std::size_t{24}, std::size_t{24'576}}) {
        const auto refused = unpack_bytes(Codec::shuffle_zstd, bomb, expected);
        REQUIRE_FALSE(bool(refused));
        CHECK(refused.error().message.find("does not state") != std::string::npos);
        CHECK_FALSE(bool(unpack_bytes(Codec::raw, bomb, expected)));
    }
    // One frame too many, an empty "skippable" one behind it, and one that claims less or more than it holds.
    const std::string good = frame_of(std::string(800, 'x'));
    REQUIRE(bool(unpack_bytes(Codec::shuffle_zstd, good, 800)));
    CHECK_FALSE(bool(unpack_bytes(Codec::shuffle_zstd, good + good, 800)));
    const std::string skippable("\x50\x2A\x4D\x18\0\0\0\0", 8);
    CHECK_FALSE(bool(unpack_bytes(Codec::shuffle_zstd, good + skippable, 800)));
    CHECK_FALSE(bool(unpack_bytes(Codec::shuffle_zstd, good, 792)));
    CHECK_FALSE(bool(unpack_bytes(Codec::shuffle_zstd, good, 801)));
    CHECK_FALSE(bool(unpack_bytes(Codec::shuffle_zstd, "", 800)));
}

TEST_CASE("a frame that claims 0, 1, 2^31 or 2^32 - 1 bytes is refused before memory is taken for them") {
    // RFC 8878: magic; descriptor of a single segment with a content size of 4 bytes; the size; an empty last block.
    const auto claiming = [](std::uint32_t bytes) {
        std::string frame("\x28\xB5\x2F\xFD\xA0", 5);
        for (int i = 0; i < 4; ++i) frame += char(bytes >> 8 * i);
        return frame + std::string("\1\0\0", 3);
    };
    CHECK(bool(unpack_bytes(Codec::shuffle_zstd, claiming(0), 0)));  // That one keeps its word.
    for (const std::uint32_t claim : {0u, 1u, 1u << 31, ~0u}) {
        CHECK_FALSE(bool(unpack_bytes(Codec::shuffle_zstd, claiming(claim), 24)));
        CHECK_FALSE(bool(unpack_bytes(Codec::shuffle_zstd, claiming(claim), 1 << 20)));
    }
    // Even the size that is expected is not there.
    CHECK_FALSE(bool(unpack_bytes(Codec::shuffle_zstd, claiming(24), 24)));
    // What is expected is the receiver's own figure, but no frame makes it take memory that it does not claim as well.
    for (const std::size_t expected :
         {std::size_t{0}, std::size_t{1}, std::size_t{1} << 31, (std::size_t{1} << 32) - 1})
        for (const auto& entry : k_codec_names)
            CHECK_FALSE(bool(unpack_bytes(entry.value, claiming(24), expected)));
}

TEST_CASE("a frame that does not state its size is refused") {
    const std::string content(800, 'x');
    std::string frame(ZSTD_compressBound(content.size()), '\0');
    ZSTD_CCtx* context = ZSTD_createCCtx();
    ZSTD_CCtx_setParameter(context, ZSTD_c_contentSizeFlag, 0);
    frame.resize(ZSTD_compress2(context, frame.data(), frame.size(), content.data(), content.size()));
    ZSTD_freeCCtx(context);
    CHECK_FALSE(bool(unpack_bytes(Codec::shuffle_zstd, frame, 800)));
}

TEST_CASE("truncated and mutated frames never crash and never give another size") {
    HashRng rng(5);
    const std::string tile = tile_like_bytes(rng, 96);
    const std::string packed = pack_bytes(Codec::shuffle_zstd, tile).bytes;
    for (std::size_t size = 0; size < packed.size(); ++size)
        CHECK_FALSE(bool(unpack_bytes(Codec::shuffle_zstd, packed.substr(0, size), tile.size())));

    int accepted = 0;
    for (int i = 0; i < 20'000; ++i) {
        std::string mutant = packed;
        mutant[rng.next_u32() % mutant.size()] = static_cast<char>(rng.next_u32());
        if (const auto back = unpack_bytes(Codec::shuffle_zstd, mutant, tile.size())) {
            REQUIRE(back->size() == tile.size());
            ++accepted;
        }
    }
    CHECK(accepted > 0);  // Literals are not checked by the frame: the tile's hash catches those.
}
