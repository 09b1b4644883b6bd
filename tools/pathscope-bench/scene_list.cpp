#include "scene_list.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace pathscope::bench {
namespace {

namespace fs = std::filesystem;
constexpr const char* k_scene_file = "scene.json";

Result<std::vector<SceneChoice>> scenes_of_folder(const fs::path& folder) {
    std::vector<SceneChoice> found;
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
        if (fs::is_regular_file(entry.path() / k_scene_file, error))
            found.push_back({entry.path().filename().string(), entry.path() / k_scene_file});
    if (found.empty())
        return bad_input(
            fmt::format("--scenes {}: no folder in there holds a {}.", folder.string(), k_scene_file));
    std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
    return found;
}

SceneChoice scene_at(const fs::path& path) {
    if (fs::is_directory(path)) return scene_at(path / k_scene_file);
    const fs::path whole = fs::absolute(path).lexically_normal();
    const fs::path name = path.extension() == ".json" ? whole.parent_path().filename() : whole.stem();
    return {name.string(), path};
}

}  // namespace

Result<std::vector<SceneChoice>> list_scenes(const BenchOptions& options) {
    std::vector<SceneChoice> all, named, elsewhere;
    if (!options.scenes.empty()) {
        Result<std::vector<SceneChoice>> found = scenes_of_folder(options.scenes);
        if (!found) return found.error();
        all = std::move(*found);
    }
    for (const std::string& wanted : options.scene) {
        const auto same_name = [&](const SceneChoice& scene) { return scene.name == wanted; };
        if (const auto found = std::find_if(all.begin(), all.end(), same_name); found != all.end())
            named.push_back(*found);
        else if (fs::exists(wanted))
            elsewhere.push_back(scene_at(wanted));
        else
            return bad_input(
                fmt::format("--scene {}: neither a folder of --scenes nor a path that exists.", wanted));
    }
    std::vector<SceneChoice> chosen = named.empty() ? all : named;
    chosen.insert(chosen.end(), elsewhere.begin(), elsewhere.end());
    if (chosen.empty())
        return bad_input(fmt::format("{} needs scenes; give --scenes DIR, or --scene PATH.", options.name));
    return chosen;
}

}  // namespace pathscope::bench
