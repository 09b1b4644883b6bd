#pragma once
/// What tests of loading share: small files, scenes of them, and what was said meanwhile.

#include <algorithm>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pathscope/core/files.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/scene/load.hpp"

#include "testing.hpp"

namespace pathscope::testing {

inline SceneFile scene_of(std::vector<std::string> objs) {
    SceneFile scene;
    scene.objs = std::move(objs);
    return scene;
}

inline SceneParts parts_of(const SceneFile& scene, FileSource& files, const SceneOptions& options = {}) {
    auto parts = load_scene_parts(scene, files, options);
    REQUIRE_MESSAGE(parts, (parts ? "" : parts.error().message));
    return std::move(*parts);
}

inline std::string error_of(const SceneFile& scene, FileSource& files) {
    const auto parts = load_scene_parts(scene, files, {});
    return parts ? "(no error)" : parts.error().message;
}

inline std::string triangle(const std::string& head = "") {
    return head + "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
}

/// A TGA of one pixel (blue, green, red, alpha), the smallest image file there is.
inline std::string tga(std::vector<std::uint8_t> bgra) {
    std::string bytes(18, '\0');
    bytes[2] = 2;
    bytes[12] = bytes[14] = 1;
    bytes[16] = char(8 * bgra.size());
    bytes.append(bgra.begin(), bgra.end());
    return bytes;
}

inline void write(const std::filesystem::path& path, std::string_view bytes) {
    std::filesystem::create_directories(path.parent_path());
    REQUIRE(write_file_atomically(path, bytes));
}

}  // namespace pathscope::testing
