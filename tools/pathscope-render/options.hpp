#pragma once
/// The command line of pathscope-render.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/render/render_settings.hpp"
#include "pathscope/scene/load.hpp"
#include "pathscope/session/checkpoint_writer.hpp"
#include "pathscope/session/client_config.hpp"

namespace pathscope {

/// Where a run begins, and how it can be gone on with.
struct CheckpointOptions {
    std::optional<std::filesystem::path> write, resume;
    bool resume_if_there = false;  ///< Else `resume` must be there.
    TimeNs every = k_default_checkpoint_interval;
};

/// What was asked for. Where nothing was said, the scene's defaults decide (run.cpp).
struct RenderOptions {
    std::filesystem::path scene;
    std::vector<std::filesystem::path> outputs;
    std::string camera;
    std::optional<std::pair<int, int>> size;
    std::optional<std::uint32_t> spp, direct_spp;
    std::optional<int> bounces;
    RenderSettings settings;  ///< Levers, seed and filter.
    SceneOptions scene_options;
    std::optional<MeshCache> mesh_cache;
    ClientConfig client;
    bool direct_only = false, indirect_only = false;
    std::vector<std::string> buffers;
    std::optional<float> exposure_ev;
    std::optional<std::filesystem::path> trace, stats;
    std::optional<std::string> metrics;  ///< ADDR:PORT
    bool metrics_public = false;
    CheckpointOptions checkpoint;
};

/// Names for --buffers.
inline constexpr std::array k_buffer_names{"direct", "indirect", "unfiltered", "albedo",
                                           "normal", "depth",    "spp"};

/// The options; or, for --help and --version, the text to print.
[[nodiscard]] Result<std::variant<RenderOptions, std::string>> parse_options(int argc,
                                                                             const char* const* argv);

}  // namespace pathscope
