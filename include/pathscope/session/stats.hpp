#pragma once
/// `--stats`: what a run did, as JSON, made from the event store and the finished frame.
///
/// Keys are a contract (docs/programs.md): scripts read them. rounds == rounds_committed says that every round of indirect
/// light was counted exactly once.
/// Units: seconds for *_s, milliseconds for *_ms, bytes. Thread safety: pure.   Test: tests/session/test_stats.cpp

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pathscope/core/hash.hpp"
#include "pathscope/image/dropped_sample.hpp"
#include "pathscope/image/image.hpp"
#include "pathscope/probe/event_store.hpp"
#include "pathscope/protocol/strategy.hpp"
#include "pathscope/scene/scene.hpp"
#include "pathscope/session/checkpoint.hpp"
#include "pathscope/session/render_state.hpp"

namespace pathscope {

/// Of the picture: what the scouts of adaptive rounds used up is not in it.
struct SamplesPerPixel {
    double min = 0, mean = 0, max = 0;
};

/// Requires: pixels, each with its number of samples.
[[nodiscard]] SamplesPerPixel summary_of(const Plane& samples);

/// What the geometry of a scene takes in memory. Textures and lights are not counted.
struct SceneMemory {
    std::uint32_t triangles = 0;
    std::size_t mesh_bytes = 0, tree_bytes = 0;
};
[[nodiscard]] SceneMemory memory_of(const Scene& scene);

/// What the store does not know.
struct RunFigures {
    double wall_s = 0, load_s = 0, build_s = 0;
    double render_s = 0;  ///< Of all runs that worked on the frame, as all counters of the totals.
    int threads = 0;
    Strategy strategy = Strategy::blocks;  ///< With another one the picture is none.
    SceneMemory memory;
    Digest image_hash{};
    std::optional<double> estimated_error;  ///< Relative; nothing when it was not asked for.
    SamplesPerPixel samples_per_pixel;      ///< As the layer `spp` has them.
    std::uint64_t saturated = 0;
    bool reproducible = true;  ///< Another run gives the same bits: no server of other bits, no lossy wire.
    std::vector<DroppedSample> dropped;  ///< Some of those counted as nonfinite_dropped.
    std::optional<WorkHistory> resumed;  ///< What earlier runs had done, if this one went on from them.
};

[[nodiscard]] std::string stats_json(const RenderState& state, const EventStore& store,
                                     const RunFigures& figures);

}  // namespace pathscope
