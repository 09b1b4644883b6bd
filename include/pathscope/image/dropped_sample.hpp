#pragma once
/// A sample that did not count: its radiance was not finite, or negative.
///
/// It is named by its pixel in the whole image and its number, so that anyone can replay it: random numbers are a pure
/// function of these. Lists of them are bounded; beyond, they are counted only.

#include <cstddef>
#include <cstdint>

namespace pathscope {

struct DroppedSample {
    std::uint32_t x = 0, y = 0, sample = 0;

    friend bool operator==(const DroppedSample&, const DroppedSample&) = default;
};

inline constexpr std::size_t k_max_dropped_listed = 64;

}  // namespace pathscope
