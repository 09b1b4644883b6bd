#include "pathscope/protocol/block_result.hpp"

#include <fmt/format.h>

#include <bit>

#include "pathscope/core/check.hpp"
#include "pathscope/core/hash.hpp"
#include "pathscope/protocol/table.hpp"

namespace pathscope {
namespace {

// Sums are moved as they lie in memory, which is the layout of the wire on every machine this is built for.
static_assert(std::endian::native == std::endian::little && sizeof(PixelSum) == 24);

/// in_range() of all of them at once: the sign bit of v is set below 0, that of most - v above the most.
bool all_in_range(std::span<const PixelSum> sums, std::uint32_t count) {
    if (count > k_max_samples_per_pixel) return sums.empty();
    const std::uint64_t most = std::uint64_t(k_max_quanta) * count;
    std::uint64_t beyond = 0;
    for (const PixelSum& sum : sums)
        for (const std::int64_t quanta : {sum.r, sum.g, sum.b})
            beyond |= std::uint64_t(quanta) | (most - std::uint64_t(quanta));
    return beyond >> 63 == 0;
}

}  // namespace

void put_block_result(message::Tile& tile, std::span<const PixelSum> sums, Codec codec) {
    CHECK(sums.size_bytes() <= k_max_tile_bytes, sums.size());
    tile.raw_bytes = static_cast<std::uint32_t>(sums.size_bytes());
    PackedBytes packed = pack_bytes(codec, {reinterpret_cast<const char*>(sums.data()), sums.size_bytes()});
    tile.codec = name_of(packed.codec);
    tile.result = std::move(packed.bytes);
    tile.hash = hash_text(tile.result);
}

Result<void> read_block_result(const message::Tile& tile, std::span<PixelSum> sums) {
    CHECK(sums.size_bytes() <= k_max_tile_bytes, sums.size());
    const auto codec = from_name<Codec>(tile.codec);
    if (!codec) return bad_input(fmt::format("TILE: codec '{}' is not known.", tile.codec));
    if (tile.raw_bytes != sums.size_bytes())
        return bad_input(fmt::format("TILE: field 'raw_bytes' is {}, but {} pixels have {}.", tile.raw_bytes,
                                     sums.size(), sums.size_bytes()));
    if (hash_text(tile.result) != tile.hash)
        return bad_input("TILE: field 'hash' is not that of the payload.");
    const auto unpacked =
        unpack_bytes(*codec, tile.result, {reinterpret_cast<char*>(sums.data()), sums.size_bytes()});
    if (!unpacked) return bad_input("TILE: " + unpacked.error().message);
    if (!all_in_range(sums, tile.count))
        return bad_input(fmt::format("TILE: a sum is beyond what {} samples can add up to.", tile.count));
    return {};
}

Result<std::vector<PixelSum>> block_result(const message::Tile& tile, std::int64_t pixels) {
    CHECK(pixels >= 0 && pixels <= std::int64_t(k_max_tile_bytes / sizeof(PixelSum)), pixels);
    std::vector<PixelSum> sums(static_cast<std::size_t>(pixels));
    if (const auto read = read_block_result(tile, sums); !read) return read.error();
    return sums;
}

}  // namespace pathscope
