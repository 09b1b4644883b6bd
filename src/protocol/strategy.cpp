#include "pathscope/protocol/strategy.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

constexpr std::int64_t k_flat_unit = std::int64_t{1} << 20;  ///< Quanta; enough to be seen in a picture.
constexpr std::int64_t k_flat_red = 512;

// The largest sample fits: sample numbers stay below 2^20, places below 2^15.
static_assert(k_flat_unit * k_max_samples_per_pixel <= k_max_quanta);
static_assert(k_flat_unit * 2 * k_max_image_side <= k_max_quanta);

}  // namespace

std::vector<PixelSum> flat_sums(const PixelRect& rect, std::uint32_t first, std::uint32_t count) {
    CHECK(count <= k_max_samples_per_pixel && first <= k_max_samples_per_pixel - count, first, count);
    const std::int64_t n = count;
    const std::int64_t sample_numbers = n * first + n * (n - 1) / 2;
    const PixelSum sum{k_flat_unit * k_flat_red * n, k_flat_unit * sample_numbers,
                       k_flat_unit * n * (rect.x + rect.y)};
    return std::vector<PixelSum>(std::size_t(rect.area()), sum);
}

Result<void> read_strategy_result(Strategy strategy, const message::Tile& tile, const PixelRect& rect,
                                  std::span<PixelSum> sums, WireFormat agreed) {
    if (tile.strategy != name_of(strategy))
        return bad_input(fmt::format("TILE: field 'strategy' is '{}', but the lease's is '{}'.",
                                     tile.strategy, name_of(strategy)));
    if (const auto read = read_block_result(tile, sums, agreed); !read) return read;
    if (strategy == Strategy::flat && !std::ranges::equal(sums, flat_sums(rect, tile.first, tile.count)))
        return bad_input("TILE: these are not the sums of the strategy 'flat'.");
    return {};
}

}  // namespace pathscope
