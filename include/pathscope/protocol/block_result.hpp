#pragma once
/// The result of the strategy `blocks`: sums of the pixels of a rectangle. docs/protocol.md, section 5.4.
///
///     server:  put_block_result(tile, sums);              // sets codec, raw_bytes, hash, result
///     client:  block_result(std::move(tile), rect.area()) // checks all four, gives the sums back
///
/// Layout before packing: pixels row by row, for each three int64 little-endian (red, green, blue), in
/// quanta.
/// Ensures: sums that come back are in range for the tile's count (image/exact_sum.hpp), so that they may be
/// added without overflow.
/// Thread safety: values.   Test: tests/protocol/test_block_result.cpp

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "pathscope/core/hash.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/image/exact_sum.hpp"
#include "pathscope/protocol/message.hpp"
#include "pathscope/wire/codec.hpp"

namespace pathscope {

inline constexpr std::string_view k_blocks_strategy = "blocks";

/// The same as TILE's field `hash`: equal sums have equal hashes.
[[nodiscard]] Digest hash_of_sums(std::span<const PixelSum> sums);

void put_block_result(message::Tile& tile, std::span<const PixelSum> sums, Codec codec = Codec::shuffle_zstd);

/// `pixels` is what the lease says, not the tile. The sentence of the error names what does not fit.
[[nodiscard]] Result<std::vector<PixelSum>> block_result(message::Tile tile, std::int64_t pixels);

}  // namespace pathscope
