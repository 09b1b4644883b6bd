#pragma once
/// Pixel codecs: how the sums of a tile become fewer bytes, without losing a bit.
///
///   raw           the bytes themselves
///   zstd          one frame of Zstandard at level 1
///   shuffle-zstd  bytes of 64-bit words sorted by significance, then Zstandard at level 1
///
/// Why shuffle: a sum of samples fills perhaps 30 of its 64 bits. Sorted by significance, the empty bytes of
/// all words stand together and cost nothing, and the slowly varying ones compress:
///
///     word 0  [a0 a1 .. a7]   word 1  [b0 b1 .. b7]   ->   a0 b0 .. | a1 b1 .. | .. | a7 b7 ..
///
/// Units: bytes. Lossless: unpack_bytes(c, pack_bytes(c, x), x.size()) == x.
/// Safety: unpacking never allocates more than the expected size, whatever the packed bytes claim.
/// Thread safety: yes.   Source: RFC 8878.   Test: tests/wire/test_codec.cpp

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/core/result.hpp"

namespace pathscope {

enum class Codec { raw, shuffle_zstd, zstd };
inline constexpr std::array k_codec_names{EnumName<Codec>{Codec::raw, "raw"},
                                          EnumName<Codec>{Codec::shuffle_zstd, "shuffle-zstd"},
                                          EnumName<Codec>{Codec::zstd, "zstd"}};
constexpr const auto& enum_table(Codec) { return k_codec_names; }

struct PackedBytes {
    Codec codec = Codec::raw;  ///< The codec used: raw where the one asked for would not save a byte.
    std::string bytes;
};

/// Takes any bytes; shuffle_zstd falls back to raw unless the size is a multiple of 8.
[[nodiscard]] PackedBytes pack_bytes(Codec codec, std::string_view raw);

/// Requires: expected_bytes is the receiver's own expectation, bounded by it, and not a figure from the wire.
[[nodiscard]] Result<std::string> unpack_bytes(Codec codec, std::string_view packed,
                                               std::size_t expected_bytes);

/// Into memory that is there already, of the size expected. After an error it may hold anything.
[[nodiscard]] Result<void> unpack_bytes(Codec codec, std::string_view packed, std::span<char> out);

}  // namespace pathscope
