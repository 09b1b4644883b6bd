#include "pathscope/protocol/block_result.hpp"

#include <fmt/format.h>

#include <bit>
#include <cstring>

#include "pathscope/core/check.hpp"
#include "pathscope/core/hash.hpp"
#include "pathscope/protocol/table.hpp"

namespace pathscope {
namespace {

// Sums are moved as they lie in memory, which is the layout of the wire on every machine this is built for.
static_assert(std::endian::native == std::endian::little && sizeof(PixelSum) == 24);

}  // namespace

Digest hash_of_sums(std::span<const PixelSum> sums) {
    return hash_text({reinterpret_cast<const char*>(sums.data()), sums.size_bytes()});
}

void put_block_result(message::Tile& tile, std::span<const PixelSum> sums, Codec codec) {
    CHECK(sums.size_bytes() <= k_max_tile_bytes, sums.size());
    std::string raw(reinterpret_cast<const char*>(sums.data()), sums.size_bytes());
    tile.raw_bytes = static_cast<std::uint32_t>(raw.size());
    tile.hash = hash_text(raw);
    PackedBytes packed = pack_bytes(codec, std::move(raw));
    tile.codec = name_of(packed.codec);
    tile.result = std::move(packed.bytes);
}

Result<std::vector<PixelSum>> block_result(message::Tile tile, std::int64_t pixels) {
    const auto expected_bytes = static_cast<std::size_t>(pixels) * sizeof(PixelSum);
    CHECK(pixels >= 0 && expected_bytes <= k_max_tile_bytes, pixels);
    const auto codec = from_name<Codec>(tile.codec);
    if (!codec) return bad_input(fmt::format("TILE: codec '{}' is not known.", tile.codec));
    if (tile.raw_bytes != expected_bytes)
        return bad_input(fmt::format("TILE: field 'raw_bytes' is {}, but {} pixels have {}.", tile.raw_bytes,
                                     pixels, expected_bytes));
    const auto raw = unpack_bytes(*codec, std::move(tile.result), expected_bytes);
    if (!raw) return bad_input("TILE: " + raw.error().message);
    if (hash_text(*raw) != tile.hash)
        return bad_input("TILE: field 'hash' is not that of the unpacked payload.");

    std::vector<PixelSum> sums(static_cast<std::size_t>(pixels));
    if (!sums.empty()) std::memcpy(sums.data(), raw->data(), raw->size());
    for (const PixelSum& sum : sums)
        if (!in_range(sum, tile.count))
            return bad_input(fmt::format("TILE: a sum is beyond what {} samples can add up to.", tile.count));
    return sums;
}

}  // namespace pathscope
