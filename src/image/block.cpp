#include "pathscope/image/block.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "pathscope/core/check.hpp"

namespace pathscope {

Result<void> check_grid(int width, int height, int block_size) {
    const auto within = [](int value, int limit) { return value >= 1 && value <= limit; };
    if (!within(width, k_max_image_side) || !within(height, k_max_image_side))
        return bad_input(fmt::format("A frame of {}x{} pixels is not possible: each side is 1 to {} pixels.",
                                     width, height, k_max_image_side));
    if (!within(block_size, k_max_block_size))
        return bad_input(fmt::format("A block size of {} is not possible: it is 1 to {} pixels.", block_size,
                                     k_max_block_size));
    return {};
}

BlockGrid::BlockGrid(int width, int height, int block_size)
    : width_(width), height_(height), block_size_(block_size) {
    CHECK(check_grid(width, height, block_size), width, height, block_size);
    columns_ = (width + block_size - 1) / block_size;
    rows_ = (height + block_size - 1) / block_size;
}

PixelRect BlockGrid::rect(std::uint32_t block) const {
    CHECK(block < count(), block, count());
    const int x = int(block) % columns_ * block_size_;
    const int y = int(block) / columns_ * block_size_;
    return {x, y, std::min(block_size_, width_ - x), std::min(block_size_, height_ - y)};
}

std::uint32_t BlockGrid::block_at(int x, int y) const {
    CHECK((PixelRect{0, 0, width_, height_}.contains(x, y)), x, y, width_, height_);
    return std::uint32_t(y / block_size_ * columns_ + x / block_size_);
}

bool BlockGrid::holds(const Round& round) const {
    return round.block < count() && round.rect == rect(round.block) && round.count >= 1 &&
           round.count <= k_max_samples_per_pixel && round.first <= k_max_samples_per_pixel - round.count;
}

}  // namespace pathscope
