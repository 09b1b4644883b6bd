#pragma once
/// Which scenes a benchmark runs on.

#include <filesystem>
#include <string>
#include <vector>

#include "bench.hpp"
#include "pathscope/core/result.hpp"

namespace pathscope::bench {

struct SceneChoice {
    std::string name;  ///< Of the folder it lies in; of a bare .obj, its own.
    std::filesystem::path path;
};

/// The folders of --scenes that hold a scene.json, by name, or those of them that --scene names; then whatever else
/// --scene gives the path of. Refuses an empty list, and a name that is neither.
[[nodiscard]] Result<std::vector<SceneChoice>> list_scenes(const BenchOptions& options);

}  // namespace pathscope::bench
