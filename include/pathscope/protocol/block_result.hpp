#pragma once
/// The result of the strategy `blocks`: sums of the pixels of a rectangle. docs/protocol.md, section 5.4.
///
///     server:  put_block_result(tile, sums);              // sets codec, raw_bytes, hash, result
///     client:  read_block_result(tile, sums);             // checks all four, gives the sums back
///
/// The hash is that of the payload as it travels: what was damaged on its way is refused before it is unpacked.
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
#include "pathscope/image/wire_format.hpp"
#include "pathscope/protocol/message.hpp"
#include "pathscope/wire/codec.hpp"

namespace pathscope {

inline constexpr std::string_view k_blocks_strategy = "blocks";

/// Of the sums themselves, however they travel: equal light has equal hashes.
[[nodiscard]] Digest hash_of_sums(std::span<const PixelSum> sums);

void put_block_result(message::Tile& tile, std::span<const PixelSum> sums, Codec codec = Codec::shuffle_zstd);
/// The same in a format that may lose bits (image/wire_format.hpp).
void put_block_result(message::Tile& tile, std::span<const PixelSum> sums, WireFormat format);

/// One sum for each pixel that the lease names, whatever the tile says. After an error `sums` may hold anything; the
/// sentence names what does not fit. Into memory of the caller's, since a client reads tens of thousands in a second.
/// A tile that lost bits is refused unless its format is the one that was agreed on; one that did not loses them here.
[[nodiscard]] Result<void> read_block_result(const message::Tile& tile, std::span<PixelSum> sums,
                                             WireFormat agreed = WireFormat::exact);

/// The same, into new memory.
[[nodiscard]] Result<std::vector<PixelSum>> block_result(const message::Tile& tile, std::int64_t pixels,
                                                         WireFormat agreed = WireFormat::exact);

}  // namespace pathscope
