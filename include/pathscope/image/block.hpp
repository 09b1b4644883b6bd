#pragma once
/// Blocks: how a frame is cut into pieces of work.
///
///   block i covers column i mod columns and row i div columns, numbered row by row from the top left corner;
///   rect(i) = [x, x + w) x [y, y + h),  w = h = block_size but for the last column and row, which take what
///   is left
///
/// Why: client, servers, ledger and panels must agree on what block 17 is from three numbers alone.
/// Units: pixels; samples for Round. Ensures: each pixel lies in exactly one block.
/// Thread safety: values.   Test: tests/image/test_block.cpp

#include <cstdint>
#include <ostream>

#include "pathscope/core/result.hpp"

namespace pathscope {

inline constexpr int k_max_image_side = 16384;  ///< Of frames, textures and files alike.
inline constexpr int k_max_block_size = 1024;
inline constexpr std::uint32_t k_max_samples_per_pixel = 1u << 20;  ///< See exact_sum.hpp.

/// The pixels [x, x + width) x [y, y + height).
struct PixelRect {
    int x = 0, y = 0, width = 0, height = 0;

    [[nodiscard]] constexpr std::int64_t area() const { return std::int64_t(width) * height; }
    [[nodiscard]] constexpr bool empty() const { return width <= 0 || height <= 0; }
    [[nodiscard]] constexpr bool contains(int px, int py) const {
        return px >= x && py >= y && px - x < width && py - y < height;
    }
    [[nodiscard]] constexpr bool contains(const PixelRect& r) const {
        return !r.empty() && contains(r.x, r.y) && contains(r.x + r.width - 1, r.y + r.height - 1);
    }
    friend constexpr bool operator==(const PixelRect&, const PixelRect&) = default;
    friend std::ostream& operator<<(std::ostream& out, const PixelRect& r) {
        return out << r.width << 'x' << r.height << '+' << r.x << '+' << r.y;
    }
};

/// A round: samples [first, first + count) of every pixel of one block.
struct Round {
    std::uint32_t block = 0;
    PixelRect rect;  ///< What the grid says of `block`.
    std::uint32_t first = 0;
    std::uint32_t count = 0;

    [[nodiscard]] constexpr std::uint64_t samples() const { return std::uint64_t(rect.area()) * count; }
    friend constexpr bool operator==(const Round&, const Round&) = default;
};

/// Whether a frame can be cut so: 1 <= width, height <= k_max_image_side and 1 <= block_size <=
/// k_max_block_size. The sentence of the error says which of the three is wrong; ask this of what people type
/// and peers send.
[[nodiscard]] Result<void> check_grid(int width, int height, int block_size);

class BlockGrid {
  public:
    BlockGrid() = default;  ///< No pixel, no block.

    /// Requires: check_grid(width, height, block_size).
    BlockGrid(int width, int height, int block_size);

    [[nodiscard]] int width() const { return width_; }
    [[nodiscard]] int height() const { return height_; }
    [[nodiscard]] int block_size() const { return block_size_; }
    [[nodiscard]] int columns() const { return columns_; }
    [[nodiscard]] int rows() const { return rows_; }
    [[nodiscard]] std::uint32_t count() const { return std::uint32_t(columns_) * std::uint32_t(rows_); }

    /// Requires: block < count().
    [[nodiscard]] PixelRect rect(std::uint32_t block) const;

    /// The block that pixel (x, y) lies in. Requires: the pixel lies in the frame.
    [[nodiscard]] std::uint32_t block_at(int x, int y) const;

    /// Requires: block < count().
    [[nodiscard]] Round round(std::uint32_t block, std::uint32_t first, std::uint32_t count) const {
        return {block, rect(block), first, count};
    }

    /// Whether a round from elsewhere fits: its block exists and has that rect, count >= 1, and its samples
    /// stay within k_max_samples_per_pixel.
    [[nodiscard]] bool holds(const Round& round) const;

    friend bool operator==(const BlockGrid&, const BlockGrid&) = default;

  private:
    int width_ = 0, height_ = 0, block_size_ = 1;
    int columns_ = 0, rows_ = 0;
};

}  // namespace pathscope
