#pragma once
/// Strategies: what the servers compute for the client. A lease names one, and its tile must be of the same.
///
///     blocks   indirect light of a block (block_result.hpp). Its bits depend on scene, state and build.
///     flat     arithmetic on the lease itself: each sample s of a block whose top left pixel is (x, y) is
///              2^20 * (512, s, x + y) quanta, so that the sums of a round [first, first + count) are, in every pixel,
///              2^20 * (512 count, first + ... + (first + count - 1), count (x + y))
///
/// Why `flat`: the network without the renderer. A server of a few lines in any language can take part, and what comes out
/// is known on paper: after n samples per pixel the mean is 2^20 * (512, (n - 1) / 2, x + y), whatever the cut into rounds and
/// whoever made them; a round that is counted twice, or not at all, shows.
/// Since the client knows what a `flat` tile must be, it believes nobody, and admits servers of any build. A frame has one
/// strategy from beginning to end, which its client's user chose: nothing of such servers can reach a picture of `blocks`.
/// Units: quanta (image/exact_sum.hpp). Thread safety: pure.
/// Test: tests/protocol/test_strategy.cpp, tests/system/test_python_worker.py

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/image/block.hpp"
#include "pathscope/image/exact_sum.hpp"
#include "pathscope/protocol/block_result.hpp"
#include "pathscope/protocol/message.hpp"

namespace pathscope {

enum class Strategy { blocks, flat };
inline constexpr std::array k_strategy_names{
    EnumName{Strategy::blocks, k_blocks_strategy},
    EnumName{Strategy::flat, "flat"},
};
constexpr const auto& enum_table(Strategy) { return k_strategy_names; }

/// Whether a server of another build may give other bits, and so must not take part.
[[nodiscard]] constexpr bool depends_on_build(Strategy strategy) { return strategy == Strategy::blocks; }

/// The sums of a `flat` tile. Requires: first + count <= k_max_samples_per_pixel.
[[nodiscard]] std::vector<PixelSum> flat_sums(const PixelRect& rect, std::uint32_t first,
                                              std::uint32_t count);

/// One sum for each pixel of `rect`, which is what the lease says, checked by all that is known about the strategy. After an
/// error `sums` may hold anything. A tile that lost bits is refused unless its format is the one that was agreed on.
[[nodiscard]] Result<void> read_strategy_result(Strategy strategy, const message::Tile& tile,
                                                const PixelRect& rect, std::span<PixelSum> sums,
                                                WireFormat agreed = WireFormat::exact);

}  // namespace pathscope
