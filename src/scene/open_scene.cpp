#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pathscope/core/files.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/scene/load.hpp"

namespace pathscope {
namespace {

namespace fs = std::filesystem;

std::string lower_extension(const fs::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return extension;
}

Result<SceneFile> read_scene_file(const fs::path& path) {
    Result<std::string> text = read_file(path);
    if (!text) return text.error();
    return parse_scene_file(*text, path.string());
}

/// What a scene.json beside a bare OBJ says about it, if it names it.
std::optional<SceneFile> neighbour_that_names(const fs::path& obj_path) {
    const fs::path path = obj_path.parent_path() / "scene.json";
    std::error_code ignored;
    if (!fs::is_regular_file(path, ignored)) return std::nullopt;
    Result<SceneFile> scene = read_scene_file(path);
    if (!scene) {
        log_warning(fmt::format("{} It is not used for {}.", scene.error().message, obj_path.string()));
        return std::nullopt;
    }
    const std::string obj = obj_path.filename().string();
    if (scene->objs == std::vector{obj}) return std::move(*scene);
    const auto variant = scene->variants.find(obj);
    if (variant == scene->variants.end()) return std::nullopt;

    // Overrides name the materials of the scene's own OBJ.
    scene->materials.clear();
    scene->name = obj_path.stem().string();
    scene->objs = {obj};
    const auto camera = std::find_if(scene->cameras.begin(), scene->cameras.end(),
                                     [&](const CameraSpec& c) { return c.name == variant->second; });
    std::rotate(scene->cameras.begin(), camera, camera + 1);
    return std::move(*scene);
}

SceneFile describe_bare_obj(const fs::path& path) {
    if (std::optional<SceneFile> scene = neighbour_that_names(path)) {
        log_note(fmt::format("Camera and lights of {} are those of {}.", path.string(),
                             (path.parent_path() / "scene.json").string()));
        return std::move(*scene);
    }
    SceneFile scene;
    scene.name = path.stem().string();
    scene.objs = {path.filename().string()};
    return scene;
}

void choose_camera(SceneFile& scene, const Mesh& mesh) {
    if (!scene.cameras.empty()) return;
    const CameraSpec camera{"chosen", camera_that_sees(bounds(mesh), up_direction(scene.up_axis)),
                            std::nullopt};
    const Vec3 from = camera.view.position, to = camera.view.look_at;
    log_note(
        fmt::format("No camera is named; it is put at ({:.6g}, {:.6g}, {:.6g}) and looks at ({:.6g}, {:.6g}, "
                    "{:.6g}), so that it sees all of the mesh.",
                    from.x, from.y, from.z, to.x, to.y, to.z));
    scene.cameras.push_back(camera);
}

void choose_lights(SceneFile& scene, const SceneParts& parts) {
    if (!scene.lights.empty()) return;
    scene.lights.emplace_back(EmissiveMtlSpec{});
    const bool has_emitter = std::any_of(parts.mesh.materials.begin(), parts.mesh.materials.end(),
                                         [&](std::uint32_t m) { return parts.materials[m].emits(); });
    if (has_emitter) return;
    scene.lights.emplace_back(SkySpec{{1, 1, 1}});
    log_note("No light is named and no material emits; a sky of radiance 1 lights the scene.");
}

}  // namespace

Result<OpenedScene> open_scene(const std::filesystem::path& path, const SceneOptions& options,
                               const std::optional<MeshCache>& cache) {
    OpenedScene opened;
    const std::string extension = lower_extension(path);
    if (extension == ".json") {
        Result<SceneFile> scene = read_scene_file(path);
        if (!scene) return scene.error();
        opened.file = std::move(*scene);
    } else if (extension == ".obj") {
        opened.file = describe_bare_obj(path);
    } else {
        return bad_input(fmt::format("{} is neither a scene file (.json) nor an OBJ (.obj).", path.string()));
    }

    opened.files = std::make_unique<DiskFiles>(path.parent_path());
    Result<SceneParts> parts = load_scene_parts(opened.file, *opened.files, options, cache);
    if (!parts) return parts.error();
    opened.parts = std::move(*parts);
    choose_camera(opened.file, opened.parts.mesh);
    choose_lights(opened.file, opened.parts);

    // What travels to servers must come back as it was; a file name that is no UTF-8 does not.
    const auto travelled = parse_scene_file(to_json(opened.file), path.string());
    if (!travelled || *travelled != opened.file)
        return bad_input(fmt::format("{}: a file name here is not UTF-8; rename it.", path.string()));
    return opened;
}

}  // namespace pathscope
