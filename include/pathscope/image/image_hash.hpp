#pragma once
/// The hash that says whether two renders are the same image, bit for bit.
///
///   BLAKE2b-256 of  width, height (32-bit unsigned), then R, G, B of each pixel (32-bit float), row by row
///   from the top, all little endian
///
/// Why: invariant 2 (the same bits for any number of servers, any schedule, any failures) is tested by
/// comparing this one line of the statistics. +0 and -0 differ, and so do two NaNs with different bits.
/// Thread safety: yes.   Test: tests/image/test_image_hash.cpp

#include "pathscope/core/hash.hpp"
#include "pathscope/image/image.hpp"

namespace pathscope {

[[nodiscard]] Digest image_hash(const Image& image);

}  // namespace pathscope
