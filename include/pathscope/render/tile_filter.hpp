#pragma once
/// The filter at the server: a round's mean is filtered alone and put back into exact sums.
///
///   sums' = count * quantise(filter(mean(sums)))
///
/// Why: the classic system filters each server's strip by itself; its borders show as seams, which a lesson explains.
/// The result depends on how the frame is cut into blocks and rounds, but not on who rendered them.
/// Thread safety: pure.   Test: tests/render/test_tile_filter.cpp     Lesson: lessons/10-bilateral-filter

#include <vector>

#include "pathscope/image/exact_sum.hpp"
#include "pathscope/render/guides.hpp"

namespace pathscope {

/// Requires: one sum per pixel of round.rect.
[[nodiscard]] std::vector<PixelSum> filter_tile(const Scene& scene, const Camera& camera,
                                                const RenderSettings& settings, const Round& round,
                                                const std::vector<PixelSum>& sums, int threads);

}  // namespace pathscope
