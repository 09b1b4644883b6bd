#include "pathscope/wire/codec.hpp"

#include <fmt/format.h>
#include <zstd.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <memory>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_word_bytes = 8;
constexpr int k_zstd_level = 1;
static_assert(std::endian::native == std::endian::little, "transpose() takes the first byte for the lowest");

/// Byte i of word j becomes byte j of word i, by exchanging halves, quarters and single bytes across the diagonal.
void transpose(std::uint64_t (&m)[k_word_bytes]) {
    const auto exchange = [&m](std::size_t distance, std::uint64_t low_bytes) {
        const std::size_t bits = 8 * distance;
        for (std::size_t i = 0; i < k_word_bytes; ++i) {
            if (i & distance) continue;
            const std::uint64_t swapped = ((m[i] >> bits) ^ m[i + distance]) & low_bytes;
            m[i] ^= swapped << bits;
            m[i + distance] ^= swapped;
        }
    };
    exchange(4, 0x00000000ffffffff);
    exchange(2, 0x0000ffff0000ffff);
    exchange(1, 0x00ff00ff00ff00ff);
}

/// Where byte `byte` of word `word` lies once all bytes of a kind lie together.
struct Planes {
    std::size_t count;
    [[nodiscard]] std::size_t place(std::size_t word, std::size_t byte) const { return byte * count + word; }
};

/// Eight words at a time; those that are left over, byte by byte.
std::string shuffle(std::string_view words) {
    const std::size_t count = words.size() / k_word_bytes;
    const Planes planes{count};
    std::string out(words.size(), '\0');
    std::uint64_t m[k_word_bytes];
    std::size_t word = 0;
    for (; word + k_word_bytes <= count; word += k_word_bytes) {
        std::memcpy(m, words.data() + word * k_word_bytes, sizeof m);
        transpose(m);
        for (std::size_t byte = 0; byte < k_word_bytes; ++byte)
            std::memcpy(out.data() + planes.place(word, byte), &m[byte], k_word_bytes);
    }
    for (; word < count; ++word)
        for (std::size_t byte = 0; byte < k_word_bytes; ++byte)
            out[planes.place(word, byte)] = words[word * k_word_bytes + byte];
    return out;
}

std::string unshuffle(std::string_view bytes) {
    const std::size_t count = bytes.size() / k_word_bytes;
    const Planes planes{count};
    std::string out(bytes.size(), '\0');
    std::uint64_t m[k_word_bytes];
    std::size_t word = 0;
    for (; word + k_word_bytes <= count; word += k_word_bytes) {
        for (std::size_t byte = 0; byte < k_word_bytes; ++byte)
            std::memcpy(&m[byte], bytes.data() + planes.place(word, byte), k_word_bytes);
        transpose(m);
        std::memcpy(out.data() + word * k_word_bytes, m, sizeof m);
    }
    for (; word < count; ++word)
        for (std::size_t byte = 0; byte < k_word_bytes; ++byte)
            out[word * k_word_bytes + byte] = bytes[planes.place(word, byte)];
    return out;
}

/// Made once for each thread: it is a megabyte to compress and a tenth of it to decompress, which would cost more than
/// packing a tile does.
ZSTD_CCtx* compressor() {
    static thread_local const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(),
                                                                                           ZSTD_freeCCtx);
    CHECK(context != nullptr);
    return context.get();
}

ZSTD_DCtx* decompressor() {
    static thread_local const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(),
                                                                                           ZSTD_freeDCtx);
    CHECK(context != nullptr);
    return context.get();
}

PackedBytes pack_shuffled(std::string raw) {
    if (raw.size() % k_word_bytes != 0) return {Codec::raw, std::move(raw)};
    const std::string planes = shuffle(raw);
    std::string packed(ZSTD_compressBound(planes.size()), '\0');
    const std::size_t size = ZSTD_compressCCtx(compressor(), packed.data(), packed.size(), planes.data(),
                                               planes.size(), k_zstd_level);
    if (ZSTD_isError(size) || size >= raw.size()) return {Codec::raw, std::move(raw)};
    packed.resize(size);
    return {Codec::shuffle_zstd, std::move(packed)};
}

Result<std::string> unpack_shuffled(std::string_view packed, std::size_t expected_bytes) {
    if (expected_bytes % k_word_bytes != 0)
        return bad_input(fmt::format("{} bytes are no whole number of 64-bit words.", expected_bytes));
    // The frame's own claim is compared before anything is allocated for it: a bomb is refused here.
    const unsigned long long claimed = ZSTD_getFrameContentSize(packed.data(), packed.size());
    if (claimed != expected_bytes)
        return bad_input(
            fmt::format("The Zstandard frame does not state {} bytes as its content size.", expected_bytes));
    if (ZSTD_findFrameCompressedSize(packed.data(), packed.size()) != packed.size())
        return bad_input("The packed bytes are not exactly one Zstandard frame.");

    std::string planes(expected_bytes, '\0');
    const std::size_t size =
        ZSTD_decompressDCtx(decompressor(), planes.data(), planes.size(), packed.data(), packed.size());
    if (ZSTD_isError(size))
        return bad_input(fmt::format("The Zstandard frame is damaged: {}.", ZSTD_getErrorName(size)));
    if (size != expected_bytes)
        return bad_input(fmt::format("The Zstandard frame holds {} bytes, not {}.", size, expected_bytes));
    return unshuffle(planes);
}

Result<std::string> unpack_raw(std::string packed, std::size_t expected_bytes) {
    if (packed.size() != expected_bytes)
        return bad_input(fmt::format("The payload has {} bytes, not {}.", packed.size(), expected_bytes));
    return packed;
}

}  // namespace

PackedBytes pack_bytes(Codec codec, std::string raw) {
    if (codec == Codec::shuffle_zstd) return pack_shuffled(std::move(raw));
    return {Codec::raw, std::move(raw)};
}

Result<std::string> unpack_bytes(Codec codec, std::string packed, std::size_t expected_bytes) {
    if (codec == Codec::shuffle_zstd) return unpack_shuffled(packed, expected_bytes);
    return unpack_raw(std::move(packed), expected_bytes);
}

}  // namespace pathscope
