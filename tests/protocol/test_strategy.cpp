// The strategy `flat` by arithmetic on paper, and tiles that are not what their lease asked for.

#include "pathscope/protocol/strategy.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

constexpr PixelRect k_rect{32, 64, 3, 2};

message::Tile flat_tile(std::uint32_t first, std::uint32_t count) {
    message::Tile tile;
    tile.strategy = name_of(Strategy::flat);
    tile.first = first;
    tile.count = count;
    put_block_result(tile, flat_sums(k_rect, first, count));
    return tile;
}

}  // namespace

TEST_CASE("each strategy has a name, and the name of each is its own") {
    for (const auto& [strategy, name] : k_strategy_names) CHECK(from_name<Strategy>(name) == strategy);
    CHECK(depends_on_build(Strategy::blocks));
    CHECK(!depends_on_build(Strategy::flat));
}

TEST_CASE("flat: the sums of samples 5, 6 and 7 of the block at (32, 64)") {
    const auto sums = flat_sums(k_rect, 5, 3);
    REQUIRE(sums.size() == 6);
    for (const PixelSum& sum : sums) CHECK(sum == PixelSum{1536 << 20, 18 << 20, 288 << 20});
}

TEST_CASE("flat: any cut into rounds adds up to the same, and stays in range") {
    for (const std::uint32_t cut : {1u, 7u, 99u}) {
        CAPTURE(cut);
        CHECK(flat_sums(k_rect, 0, cut)[0] + flat_sums(k_rect, cut, 100 - cut)[0] ==
              flat_sums(k_rect, 0, 100)[0]);
    }
    const PixelRect last{k_max_image_side - 1, k_max_image_side - 1, 1, 1};
    CHECK(in_range(flat_sums(last, 0, k_max_samples_per_pixel)[0], k_max_samples_per_pixel));
}

TEST_CASE("a tile is taken if it is of the lease's strategy and, where that is known, has the right sums") {
    std::vector<PixelSum> read(6);
    REQUIRE(read_strategy_result(Strategy::flat, flat_tile(4, 4), k_rect, read));
    CHECK(read == flat_sums(k_rect, 4, 4));

    const auto of_blocks = read_strategy_result(Strategy::blocks, flat_tile(4, 4), k_rect, read);
    REQUIRE(!of_blocks);
    CHECK(of_blocks.error().message.find("'strategy' is 'flat'") != std::string::npos);

    message::Tile wrong = flat_tile(4, 4);
    auto sums = flat_sums(k_rect, 4, 4);
    ++sums[5].b;
    put_block_result(wrong, sums);
    CHECK(!read_strategy_result(Strategy::flat, wrong, k_rect, read));
    CHECK(!read_strategy_result(Strategy::flat, flat_tile(4, 4), {32, 65, 3, 2}, read));
}
