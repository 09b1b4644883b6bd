#include "pathscope/wire/codec.hpp"

#include <fmt/format.h>
#include <zstd.h>

#include <cstdint>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_word_bytes = 8;
constexpr int k_zstd_level = 1;

std::string shuffle(std::string_view words) {
    const std::size_t count = words.size() / k_word_bytes;
    std::string planes(words.size(), '\0');
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t byte = 0; byte < k_word_bytes; ++byte)
            planes[byte * count + i] = words[i * k_word_bytes + byte];
    return planes;
}

std::string unshuffle(std::string_view planes) {
    const std::size_t count = planes.size() / k_word_bytes;
    std::string words(planes.size(), '\0');
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t byte = 0; byte < k_word_bytes; ++byte)
            words[i * k_word_bytes + byte] = planes[byte * count + i];
    return words;
}

PackedBytes pack_shuffled(std::string raw) {
    if (raw.size() % k_word_bytes != 0) return {Codec::raw, std::move(raw)};
    const std::string planes = shuffle(raw);
    std::string packed(ZSTD_compressBound(planes.size()), '\0');
    const std::size_t size =
        ZSTD_compress(packed.data(), packed.size(), planes.data(), planes.size(), k_zstd_level);
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
    const std::size_t size = ZSTD_decompress(planes.data(), planes.size(), packed.data(), packed.size());
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
