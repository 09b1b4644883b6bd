/// Scene files, from the text to the scene that is rendered: a client, who may be anybody, sends them to a server.

#include "../scene/memory_files.hpp"
#include "fuzz_target.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/core/files.hpp"
#include "pathscope/image/exact_sum.hpp"
#include "pathscope/scene/load.hpp"
#include "pathscope/scene/scene.hpp"
#include "pathscope/scene/scene_file.hpp"

namespace pathscope::fuzz {
namespace {

constexpr const char* k_obj =
    "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl wall\nf 1 2 3\nusemtl lamp\nf 3 2 1\n";
constexpr const char* k_mtl = "newmtl wall\nKd 0.5 0.5 0.5\nnewmtl lamp\nKe 3 2 1\n";

void check_text(const SceneFile& scene) {
    const std::string text = to_json(scene);
    const auto again = parse_scene_file(text, "again");
    CHECK(bool(again), again.error().message, text);
    CHECK(*again == scene, text);
    CHECK(to_json(*again) == text, text);
}

/// Every OBJ that the scene names holds two triangles.
void build(const SceneFile& file) {
    if (file.objs.size() > 4) return;
    testing::MemoryFiles files;
    for (const std::string& obj : file.objs) {
        const std::string name = scene_name("", obj);
        files.files[name] = k_obj;
        files.files[scene_name(name, "a.mtl")] = k_mtl;
    }
    auto parts = load_scene_parts(file, files, SceneOptions{});
    if (!parts) return CHECK(!parts.error().message.empty());
    const auto scene = make_scene(file, std::move(*parts), {.threads = 1});
    if (!scene) return CHECK(!scene.error().message.empty());
    CHECK(quantum_for(scene->typical_radiance, scene->brightest_radiance).valid());
}

void read_anything(std::string_view bytes) {
    const auto scene = parse_scene_file(bytes, "scene.json");
    if (!scene) return CHECK(!scene.error().message.empty());
    check_text(*scene);
    build(*scene);
}

std::vector<std::string> seeds() {
    std::vector<std::string> seeds;
    for (const char* path :
         {"scenes/atrium/scene.json", "scenes/cornell/scene.json", "scenes/furnace/scene.json",
          "scenes/furnace/white.json", "scenes/mis_plates/scene.json"})
        if (auto text = read_file(path); text && text->size() <= 4096) seeds.push_back(std::move(*text));
    const auto with_light = [&](std::string_view light) {
        seeds.push_back(R"({"obj": "a.obj", "lights": [{"type": )" + std::string(light) + "}]}");
    };
    with_light(R"("emissive_mtl", "two_sided": true)");
    with_light(
        R"("quad", "corner": [0, 0, 2], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0], "radiance": [9, 9, 9])");
    with_light(R"("sphere", "centre": [0, 0, 2], "radius": 0.5, "radiance": [1, 2, 3])");
    with_light(R"("point", "position": [0, 3, 0], "intensity": [5, 5, 5])");
    with_light(R"("sun", "to_sun": [0, 1, 0], "irradiance": [1, 1, 1], "angle_deg": 0.5)");
    with_light(R"("sky", "radiance": [0.5, 0.5, 1])");
    with_light(R"("sky", "radiance": [0, 3e38, 0])");
    with_light(R"("sky", "radiance": [0, 0, 1e-45])");
    with_light(R"("envmap", "file": "sky.pfm", "scale": 2, "rotate_y": 90)");
    seeds.push_back(R"({"name": "n", "obj": ["a.obj", "b.obj"], "up_axis": "Z", "units_to_metres": 0.01,
        "camera": {"name": "c", "position": [0, 0, 4], "look_at": [0, 0, 0], "up": [0, 1, 0], "vfov_deg": 40, "aspect": "16:9"},
        "variants": {"c.obj": "c"}, "exposure_ev": -1,
        "materials": {"wall": {"model": "glass", "kd": [1, 0, 0], "ks": [0, 1, 0], "ke": [0, 0, 1], "roughness": 0.1,
            "metallic": 1, "ior": 1.5, "opacity": 0.5, "map_kd": "a.png", "map_d": "", "map_roughness": "r.png"}},
        "defaults": {"size": [640, 480], "spp": 64, "bounces": 7},
        "preview": {"renderer": "r", "view_transform": "v", "exposure_ev": 0}})");
    return seeds;
}

const FuzzTarget k_target{"scene", read_anything, seeds};

}  // namespace
}  // namespace pathscope::fuzz
