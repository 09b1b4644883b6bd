#include "pathscope/wire/codec.hpp"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <memory>
#include <optional>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_word_bytes = 8;
constexpr int k_zstd_level = 1;
static_assert(std::endian::native == std::endian::little, "the first byte of a word is taken for its lowest");

/// Eight vectors of sixteen bytes, shuffled as a deck of cards is: the first of the lower half, the first of the upper half,
/// the second of the lower half... The number of a byte's place has seven bits, and this turns them left by one. As planes,
/// the number is [byte of the word : 3 bits][word : 4 bits]; as words it is [word][byte]. So three shuffles make words of
/// planes, and four, which complete the circle, planes of words.
using Bytes16 = std::uint8_t __attribute__((vector_size(16)));
constexpr std::size_t k_words_at_once = sizeof(Bytes16);

void shuffle_deck(Bytes16 (&deck)[k_word_bytes]) {
    constexpr std::size_t k_half = k_word_bytes / 2;
    Bytes16 out[k_word_bytes];
    for (std::size_t i = 0; i < k_half; ++i) {
        const Bytes16 a = deck[i], b = deck[i + k_half];
        out[2 * i] = __builtin_shufflevector(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
        out[2 * i + 1] =
            __builtin_shufflevector(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
    }
    std::copy(std::begin(out), std::end(out), std::begin(deck));
}

/// Where byte `byte` of word `word` lies once all bytes of a kind lie together.
struct Planes {
    std::size_t count;
    [[nodiscard]] std::size_t place(std::size_t word, std::size_t byte) const { return byte * count + word; }
};

/// Sixteen words at a time; those that are left over, byte by byte.
std::string shuffle(std::string_view words) {
    const std::size_t count = words.size() / k_word_bytes;
    const Planes planes{count};
    std::string out(words.size(), '\0');
    Bytes16 deck[k_word_bytes];
    std::size_t word = 0;
    for (; word + k_words_at_once <= count; word += k_words_at_once) {
        std::memcpy(deck, words.data() + word * k_word_bytes, sizeof deck);
        for (int time = 0; time < 4; ++time) shuffle_deck(deck);
        for (std::size_t byte = 0; byte < k_word_bytes; ++byte)
            std::memcpy(out.data() + planes.place(word, byte), &deck[byte], sizeof deck[byte]);
    }
    for (; word < count; ++word)
        for (std::size_t byte = 0; byte < k_word_bytes; ++byte)
            out[planes.place(word, byte)] = words[word * k_word_bytes + byte];
    return out;
}

void unshuffle(std::string_view bytes, std::span<char> out) {
    const std::size_t count = bytes.size() / k_word_bytes;
    const Planes planes{count};
    Bytes16 deck[k_word_bytes];
    std::size_t word = 0;
    for (; word + k_words_at_once <= count; word += k_words_at_once) {
        for (std::size_t byte = 0; byte < k_word_bytes; ++byte)
            std::memcpy(&deck[byte], bytes.data() + planes.place(word, byte), sizeof deck[byte]);
        for (int time = 0; time < 3; ++time) shuffle_deck(deck);
        std::memcpy(out.data() + word * k_word_bytes, deck, sizeof deck);
    }
    for (; word < count; ++word)
        for (std::size_t byte = 0; byte < k_word_bytes; ++byte)
            out[word * k_word_bytes + byte] = bytes[planes.place(word, byte)];
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

/// Nothing where it would not save a byte.
std::optional<std::string> compress(std::string_view bytes) {
    std::string packed(ZSTD_compressBound(bytes.size()), '\0');
    const std::size_t size = ZSTD_compressCCtx(compressor(), packed.data(), packed.size(), bytes.data(),
                                               bytes.size(), k_zstd_level);
    if (ZSTD_isError(size) || size >= bytes.size()) return std::nullopt;
    packed.resize(size);
    return packed;
}

/// Whether the packed bytes say of themselves that they hold so many. A bomb is refused here, before any memory is taken.
Result<void> check_claim(Codec codec, std::string_view packed, std::size_t expected_bytes) {
    if (codec == Codec::raw) {
        if (packed.size() == expected_bytes) return {};
        return bad_input(fmt::format("The payload has {} bytes, not {}.", packed.size(), expected_bytes));
    }
    if (codec == Codec::shuffle_zstd && expected_bytes % k_word_bytes != 0)
        return bad_input(fmt::format("{} bytes are no whole number of 64-bit words.", expected_bytes));
    const unsigned long long claimed = ZSTD_getFrameContentSize(packed.data(), packed.size());
    if (claimed != expected_bytes)
        return bad_input(
            fmt::format("The Zstandard frame does not state {} bytes as its content size.", expected_bytes));
    if (ZSTD_findFrameCompressedSize(packed.data(), packed.size()) != packed.size())
        return bad_input("The packed bytes are not exactly one Zstandard frame.");
    return {};
}

/// Requires: check_claim() for the size of `out`.
Result<void> decompress(std::string_view packed, std::span<char> out) {
    const std::size_t size =
        ZSTD_decompressDCtx(decompressor(), out.data(), out.size(), packed.data(), packed.size());
    if (ZSTD_isError(size))
        return bad_input(fmt::format("The Zstandard frame is damaged: {}.", ZSTD_getErrorName(size)));
    if (size != out.size())
        return bad_input(fmt::format("The Zstandard frame holds {} bytes, not {}.", size, out.size()));
    return {};
}

/// Requires: check_claim() for the size of `out`.
Result<void> decompress_shuffled(std::string_view packed, std::span<char> out) {
    // Kept from tile to tile: fresh memory for each would cost more than unpacking does.
    static thread_local std::string planes;
    planes.resize(out.size());
    if (auto whole = decompress(packed, planes); !whole) return whole;
    unshuffle(planes, out);
    return {};
}

/// Requires: check_claim() for the size of `out`.
Result<void> unpack_checked(Codec codec, std::string_view packed, std::span<char> out) {
    if (codec == Codec::shuffle_zstd) return decompress_shuffled(packed, out);
    if (codec == Codec::zstd) return decompress(packed, out);
    std::copy(packed.begin(), packed.end(), out.begin());
    return {};
}

}  // namespace

PackedBytes pack_bytes(Codec codec, std::string_view raw) {
    const bool has_words = raw.size() % k_word_bytes == 0;
    std::optional<std::string> packed;
    if (codec == Codec::shuffle_zstd && has_words) packed = compress(shuffle(raw));
    if (codec == Codec::zstd) packed = compress(raw);
    if (packed) return {codec, std::move(*packed)};
    return {Codec::raw, std::string(raw)};
}

Result<void> unpack_bytes(Codec codec, std::string_view packed, std::span<char> out) {
    if (auto claim = check_claim(codec, packed, out.size()); !claim) return claim;
    return unpack_checked(codec, packed, out);
}

Result<std::string> unpack_bytes(Codec codec, std::string_view packed, std::size_t expected_bytes) {
    if (const auto claim = check_claim(codec, packed, expected_bytes); !claim) return claim.error();
    std::string out(expected_bytes, '\0');
    if (const auto unpacked = unpack_checked(codec, packed, out); !unpacked) return unpacked.error();
    return out;
}

}  // namespace pathscope
