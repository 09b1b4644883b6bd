#pragma once
/// What stopped the last ray that went this way?
///
///     occluder(d) = the block of triangles that stopped the last ray whose direction lay in the same cell as d
///
/// Why: shadow rays of neighbouring points towards one light, or one part of the sky, are stopped by the same wall. A ray that
/// asks this block first needs no tree in most cases: in a building two thirds of the rays from what a camera sees. Where
/// nothing stands in the way the cell is empty, and the ray loses nothing.
///
/// The answers are those without it, whatever it holds, be it from another tree: a block that stops the ray is an answer, and
/// one that does not is none.
///
/// Cells: the octahedron |x| + |y| + |z| = 1 seen along z, a square grid on each of its two halves. Eight by eight are few enough
/// to be filled by the first rays of a picture's tile.
/// Thread safety: one for each thread.
/// Source: Haines & Greenberg 1986, "The Light Buffer: A Shadow-Testing Accelerator" (cells of directions, and the last occluder).
/// Test: tests/bvh/test_occluder_cache.cpp

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "pathscope/math/vec.hpp"

namespace pathscope {

inline constexpr std::uint32_t k_no_occluder = 0xffffffff;

class OccluderCache {
  public:
    OccluderCache() { blocks_.fill(k_no_occluder); }

    /// The number of a block of the wide tree, or k_no_occluder.
    [[nodiscard]] std::uint32_t& towards(Vec3 direction) {
        const float to_octahedron =
            1 / (std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z));
        const std::size_t column = place(direction.x * to_octahedron),
                          row = place(direction.y * to_octahedron);
        return blocks_[(std::size_t{direction.z < 0} * k_side + row) * k_side + column];
    }

  private:
    static constexpr std::size_t k_side = 8;

    static std::size_t place(float minus_one_to_one) {
        constexpr float half = 0.5f * float(k_side);
        return static_cast<std::size_t>(
            std::min(std::max(0.0f, minus_one_to_one * half + half), float(k_side) - 0.5f));
    }

    std::array<std::uint32_t, 2 * k_side * k_side> blocks_;
};

}  // namespace pathscope
