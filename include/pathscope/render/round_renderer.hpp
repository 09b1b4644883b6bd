#pragma once
/// A round: samples [first, first + count) of one block's pixels, as exact sums.
///
/// Why: this is the unit of work, whoever does it. A round is a pure function of (scene, camera, settings, part, round),
/// so the client and any server give the same bits, and the threads that share its rows do not matter.
/// Dropped: a sample that is not finite or negative adds nothing, and is listed with its pixel and number; it still counts
/// in the mean. Saturated: a sample beyond the range of the exact sums is clamped and counted.
/// Thread safety: pure; may run on several threads at once over one scene.
/// Test: tests/render/test_round_renderer.cpp

#include <atomic>
#include <cstdint>
#include <optional>
#include <vector>

#include "pathscope/image/block.hpp"
#include "pathscope/image/dropped_sample.hpp"
#include "pathscope/image/exact_sum.hpp"
#include "pathscope/integrator/path_estimator.hpp"
#include "pathscope/render/render_settings.hpp"
#include "pathscope/scene/camera.hpp"
#include "pathscope/scene/scene.hpp"

namespace pathscope {

/// What a round yields. `sums` holds one entry per pixel of the rect, row by row.
struct RoundResult {
    std::vector<PixelSum> sums;
    std::uint64_t rays = 0;
    std::uint64_t samples = 0;
    std::vector<DroppedSample> dropped;  ///< The first k_max_dropped_listed of them.
    std::uint64_t dropped_count = 0;
    std::uint64_t saturated_count = 0;
};

/// Says between rows whether the work is still wanted.
using CancelFlag = std::atomic<bool>;

/// Rises by the samples that are done, many times while a row is rendered: who works moves it.
using WorkCounter = std::atomic<std::uint64_t>;

/// Returns nothing when `cancelled` became true. Requires: the round lies inside the frame of `settings`.
[[nodiscard]] std::optional<RoundResult> render_round(const Scene& scene, const Camera& camera,
                                                      const RenderSettings& settings, LightPart part,
                                                      const Round& round, int threads,
                                                      const CancelFlag* cancelled = nullptr,
                                                      WorkCounter* work_done = nullptr);

/// Both parts of a round, by walks that the two share (integrator/path_batch.hpp): the sums of render_round(), bit by bit.
struct PartsResult {
    RoundResult direct;  ///< Its rays are counted in `indirect`.
    RoundResult indirect;
};
[[nodiscard]] std::optional<PartsResult> render_both_parts(const Scene& scene, const Camera& camera,
                                                           const RenderSettings& settings, const Round& round,
                                                           int threads, const CancelFlag* cancelled = nullptr,
                                                           WorkCounter* work_done = nullptr);

}  // namespace pathscope
