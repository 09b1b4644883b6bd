#include "pathscope/protocol/block_result.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <string_view>

#include "pathscope/core/check.hpp"
#include "pathscope/core/hash.hpp"
#include "pathscope/protocol/table.hpp"

namespace pathscope {
namespace {

// Sums are moved as they lie in memory, which is the layout of the wire on every machine this is built for.
static_assert(std::endian::native == std::endian::little && sizeof(PixelSum) == 24);

/// Field `codec` of TILE: the format of the sums, and how its bytes are packed.
struct TileCodec {
    std::string_view name;
    WireFormat format;
    Codec codec;
};
constexpr std::array k_tile_codecs{TileCodec{"raw", WireFormat::exact, Codec::raw},
                                   TileCodec{"shuffle-zstd", WireFormat::exact, Codec::shuffle_zstd},
                                   TileCodec{"half", WireFormat::half, Codec::raw},
                                   TileCodec{"half-zstd", WireFormat::half, Codec::zstd},
                                   TileCodec{"shared", WireFormat::shared, Codec::raw},
                                   TileCodec{"shared-zstd", WireFormat::shared, Codec::zstd}};

void put(message::Tile& tile, WireFormat format, Codec codec, std::string_view bytes) {
    CHECK(bytes.size() <= k_max_tile_bytes, bytes.size());
    tile.raw_bytes = static_cast<std::uint32_t>(bytes.size());
    PackedBytes packed = pack_bytes(codec, bytes);
    tile.codec = std::find_if(k_tile_codecs.begin(), k_tile_codecs.end(), [&](const TileCodec& one) {
                     return one.format == format && one.codec == packed.codec;
                 })->name;
    tile.result = std::move(packed.bytes);
    tile.hash = hash_text(tile.result);
}

/// Unpacks sums of a lossy format. Requires: raw_bytes is what the format has.
Result<void> read_lossy(const message::Tile& tile, const TileCodec& how, std::span<PixelSum> sums) {
    const auto bytes = unpack_bytes(how.codec, tile.result, std::size_t{tile.raw_bytes});
    if (!bytes) return bytes.error();
    return read_rounded_sums(how.format, *bytes, tile.count, sums);
}

/// Nearly always answered by all bits that any sum has: no number, taken as unsigned, is above the bits of all together.
bool all_in_range(std::span<const PixelSum> sums, std::uint32_t count) {
    std::uint64_t bits = 0;
    for (const PixelSum& sum : sums)
        bits |= std::uint64_t(sum.r) | std::uint64_t(sum.g) | std::uint64_t(sum.b);
    if (count <= k_max_samples_per_pixel && bits <= std::uint64_t(k_max_quanta) * count) return true;
    return std::all_of(sums.begin(), sums.end(),
                       [count](const PixelSum& sum) { return in_range(sum, count); });
}

}  // namespace

Digest hash_of_sums(std::span<const PixelSum> sums) {
    return hash_text({reinterpret_cast<const char*>(sums.data()), sums.size_bytes()});
}

void put_block_result(message::Tile& tile, std::span<const PixelSum> sums, Codec codec) {
    CHECK(codec != Codec::zstd);
    put(tile, WireFormat::exact, codec, {reinterpret_cast<const char*>(sums.data()), sums.size_bytes()});
}

void put_block_result(message::Tile& tile, std::span<const PixelSum> sums, WireFormat format) {
    if (format == WireFormat::exact) return put_block_result(tile, sums);
    put(tile, format, Codec::zstd, round_sums(format, sums));
}

Result<void> read_block_result(const message::Tile& tile, std::span<PixelSum> sums, WireFormat agreed) {
    CHECK(sums.size_bytes() <= k_max_tile_bytes, sums.size());
    const auto* const how = std::find_if(k_tile_codecs.begin(), k_tile_codecs.end(),
                                         [&](const TileCodec& one) { return one.name == tile.codec; });
    if (how == k_tile_codecs.end())
        return bad_input(fmt::format("TILE: codec '{}' is not known.", tile.codec));
    if (how->format != WireFormat::exact && how->format != agreed)
        return bad_input(fmt::format("TILE: codec '{}' loses bits, and was not asked for.", tile.codec));
    if (const std::size_t expected = wire_bytes(how->format, sums.size()); tile.raw_bytes != expected)
        return bad_input(fmt::format("TILE: field 'raw_bytes' is {}, but {} pixels have {}.", tile.raw_bytes,
                                     sums.size(), expected));
    if (hash_text(tile.result) != tile.hash)
        return bad_input("TILE: field 'hash' is not that of the payload.");
    if (how->format != WireFormat::exact) {
        const auto read = read_lossy(tile, *how, sums);
        return read ? read : bad_input("TILE: " + read.error().message);
    }
    const auto unpacked =
        unpack_bytes(how->codec, tile.result, {reinterpret_cast<char*>(sums.data()), sums.size_bytes()});
    if (!unpacked) return bad_input("TILE: " + unpacked.error().message);
    if (!all_in_range(sums, tile.count))
        return bad_input(fmt::format("TILE: a sum is beyond what {} samples can add up to.", tile.count));
    // Whoever sends more than was agreed on counts for as much as all others: their results have to be comparable.
    return agreed == WireFormat::exact
               ? Result<void>()
               : read_rounded_sums(agreed, round_sums(agreed, sums), tile.count, sums);
}

Result<std::vector<PixelSum>> block_result(const message::Tile& tile, std::int64_t pixels,
                                           WireFormat agreed) {
    CHECK(pixels >= 0 && pixels <= std::int64_t(k_max_tile_bytes / sizeof(PixelSum)), pixels);
    std::vector<PixelSum> sums(static_cast<std::size_t>(pixels));
    if (const auto read = read_block_result(tile, sums, agreed); !read) return read.error();
    return sums;
}

}  // namespace pathscope
