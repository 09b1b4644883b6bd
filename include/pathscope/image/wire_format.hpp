#pragma once
/// Sums of a block in fewer bits than they have: what is lost, and how much at most.
///
///   exact    every bit                                                         24 bytes per pixel, before packing
///   half     each channel as a half float                                       6 bytes
///   shared   three mantissas of 9 bits and one exponent, as in GL's RGB9_E5     4 bytes
///
/// Both lossy formats have an exponent e for the whole block, so that its brightest channel falls where the format is best:
/// a sum is  code * 2^e,  and a code cannot overflow. What the samples add up to is what travels and not their mean: the
/// number of samples is known to both sides, so it is the same thing without a division.
///
/// Error, for a block whose brightest sum is B:
///   half     |error| <= 2^-11 * sum     for a sum >= 2^-28 * B, and <= 2^-39 * B below
///   shared   |error| <= 2^-9  * the pixel's largest channel, if that is >= 2^-30 * B, and <= 2^-39 * B below
/// Sums that have no more bits than a mantissa come back as they were: black stays black.
///
/// An image of rounded sums depends on how its samples were grouped into rounds and on who rendered what, so it is not
/// reproducible; and light that is a thousand times dimmer than a pixel's brightest channel is gone with `shared`.
/// Layout: docs/protocol.md, section 5.6.
/// Source: IEEE 754 binary16; EXT_texture_shared_exponent.
/// Thread safety: pure.   Test: tests/image/test_wire_format.cpp

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/image/exact_sum.hpp"

namespace pathscope {

enum class WireFormat { exact, half, shared };
inline constexpr std::array k_wire_format_names{EnumName<WireFormat>{WireFormat::exact, "exact"},
                                                EnumName<WireFormat>{WireFormat::half, "half"},
                                                EnumName<WireFormat>{WireFormat::shared, "shared"}};
constexpr const auto& enum_table(WireFormat) { return k_wire_format_names; }

/// Of so many pixels, before packing.
[[nodiscard]] std::size_t wire_bytes(WireFormat format, std::size_t pixels);

/// Requires: a lossy format, and sums >= 0.
[[nodiscard]] std::string round_sums(WireFormat format, std::span<const PixelSum> sums);

/// The inverse, for bytes from anyone: what no round_sums() can have made of `count` samples is an error, and then `sums`
/// may hold anything. Requires: a lossy format, wire_bytes() bytes. Ensures: every sum is in_range() for `count`.
[[nodiscard]] Result<void> read_rounded_sums(WireFormat format, std::string_view bytes, std::uint32_t count,
                                             std::span<PixelSum> sums);

}  // namespace pathscope
