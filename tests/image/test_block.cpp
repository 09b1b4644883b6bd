#include "pathscope/image/block.hpp"

#include <vector>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("every pixel lies in exactly one block, and block_at finds it") {
    HashRng rng(1);
    for (int trial = 0; trial < 50; ++trial) {
        const int width = 1 + int(rng.next_u32() % 90), height = 1 + int(rng.next_u32() % 90);
        const BlockGrid grid(width, height, 1 + int(rng.next_u32() % 40));
        std::vector<int> covered(std::size_t(width * height));
        bool found = true;
        for (std::uint32_t block = 0; block < grid.count(); ++block) {
            const PixelRect rect = grid.rect(block);
            for (int y = rect.y; y < rect.y + rect.height; ++y) {
                for (int x = rect.x; x < rect.x + rect.width; ++x) {
                    ++covered.at(std::size_t(y * width + x));
                    found = found && grid.block_at(x, y) == block;
                }
            }
        }
        CHECK(found);
        CHECK(covered == std::vector<int>(covered.size(), 1));
    }
}

TEST_CASE("blocks are numbered row by row; the last column and row take what is left") {
    const BlockGrid grid(70, 40, 32);
    CHECK(grid.columns() == 3);
    CHECK(grid.rows() == 2);
    CHECK(grid.count() == 6);
    CHECK(grid.rect(0) == PixelRect{0, 0, 32, 32});
    CHECK(grid.rect(2) == PixelRect{64, 0, 6, 32});
    CHECK(grid.rect(3) == PixelRect{0, 32, 32, 8});
    CHECK(grid.rect(5) == PixelRect{64, 32, 6, 8});
    CHECK(BlockGrid(5, 5, 32).rect(0) == PixelRect{0, 0, 5, 5});
    CHECK(BlockGrid().count() == 0);
}

TEST_CASE("check_grid refuses what cannot be a frame and says which number is wrong") {
    CHECK(bool(check_grid(1, 1, 1)));
    CHECK(bool(check_grid(k_max_image_side, k_max_image_side, k_max_block_size)));
    for (const int wrong : {0, -1, k_max_image_side + 1}) {
        CHECK(check_grid(wrong, 10, 32).error().message.find("frame of") != std::string::npos);
        CHECK(check_grid(10, wrong, 32).error().message.find("frame of") != std::string::npos);
    }
    for (const int wrong : {0, -5, k_max_block_size + 1})
        CHECK(check_grid(10, 10, wrong).error().message.find("block size of") != std::string::npos);
}

TEST_CASE("a grid holds only rounds that it could have made") {
    const BlockGrid grid(70, 40, 32);
    const Round good = grid.round(5, 16, 4);
    CHECK(grid.holds(good));
    CHECK(good.samples() == 6 * 8 * 4);

    const auto changed = [&](auto change) {
        Round round = good;
        change(round);
        return round;
    };
    CHECK_FALSE(grid.holds(changed([](Round& r) { r.block = 6; })));
    CHECK_FALSE(grid.holds(changed([](Round& r) { r.block = 4; })));
    CHECK_FALSE(grid.holds(changed([](Round& r) { r.rect.width = 32; })));
    CHECK_FALSE(grid.holds(changed([](Round& r) { r.count = 0; })));
    CHECK_FALSE(grid.holds(changed([](Round& r) { r.first = 0xffffffffu; })));
    CHECK_FALSE(grid.holds(changed([](Round& r) { r.count = 0xffffffffu; })));
    CHECK(grid.holds(grid.round(5, k_max_samples_per_pixel - 4, 4)));
    CHECK_FALSE(grid.holds(grid.round(5, k_max_samples_per_pixel - 3, 4)));
}

TEST_CASE("a rectangle contains points and rectangles") {
    const PixelRect rect{2, 3, 4, 5};
    CHECK(rect.contains(2, 3));
    CHECK(rect.contains(5, 7));
    CHECK_FALSE(rect.contains(6, 7));
    CHECK_FALSE(rect.contains(5, 8));
    CHECK_FALSE(rect.contains(1, 3));
    CHECK(rect.contains(rect));
    CHECK_FALSE(rect.contains(PixelRect{2, 3, 5, 5}));
    CHECK_FALSE(rect.contains(PixelRect{2, 3, 0, 0}));
    CHECK(rect.area() == 20);
}
