#include <filesystem>
#include <string>

#include "pathscope/core/files.hpp"
#include "pathscope/scene/load.hpp"

#include "log_capture.hpp"
#include "testing.hpp"

#include "scene/loading.hpp"

using namespace pathscope;
using namespace pathscope::testing;
namespace fs = std::filesystem;

TEST_CASE("the project's own scenes load, as far as their models are there") {
    int loaded = 0;
    for (const auto& entry : fs::recursive_directory_iterator("scenes")) {
        if (entry.path().extension() != ".json") continue;
        CAPTURE(entry.path());
        const auto text = read_file(entry.path());
        REQUIRE(text);
        const auto scene = parse_scene_file(*text, entry.path().string());
        REQUIRE_MESSAGE(scene, (scene ? "" : scene.error().message));
        const bool is_generated = entry.path().parent_path().filename() == "atrium";
        if (is_generated) continue;  // Its model is made by make-atrium, and large.
        const LogCapture listener;
        const auto opened = open_scene(entry.path(), {});
        REQUIRE_MESSAGE(opened, (opened ? "" : opened.error().message));
        CHECK(listener.said.empty());
        ++loaded;
    }
    CHECK(loaded >= 4);
}

TEST_CASE("the shared scenes load: triangles, materials, textures") {
    const auto folder = testing::shared_folder();
    if (folder.empty()) {
        MESSAGE("skipped: no ../shared");
        return;
    }
    struct Case {
        std::string path;
        std::size_t triangles, materials, textures;
        int said;
    };
    // As the folder's README counts them, less materials that no face uses and bump maps.
    const Case cases[] = {
        {"mitsuba_cornell/scene.json", 36, 8, 0, 0},
        {"cornell_box/scene.json", 36, 8, 0, 0},
        {"cornell_box/CornellBox-Water.obj", 7'088, 9, 0, 1},
        {"cornell_box/CornellBox-Empty-CO.obj", 12, 6, 0, 1},
        {"dabrovic_sponza/scene.json", 66'450, 20, 12, 2},
        {"veach_mis/scene.json", 6'676, 8, 0, 0},
        {"veach_ajar/scene.json", 51'594, 13, 4, 0},
        {"stanford_dragon/scene.json", 100'002, 2, 0, 0},
        {"conference/scene.json", 331'179, 35, 0, 0},
        {"crytek_sponza/scene.json", 262'267, 25, 28, 1},
    };
    for (const Case& c : cases) {
        if (testing::k_sanitized && c.triangles > 60'000) continue;
        CAPTURE(c.path);
        const LogCapture listener;
        const auto opened = open_scene(folder / "scenes" / c.path, {});
        REQUIRE_MESSAGE(opened, (opened ? "" : opened.error().message));
        CHECK(opened->parts.mesh.triangles.size() + opened->parts.degenerate_triangles == c.triangles);
        CHECK(opened->parts.materials.size() == c.materials);
        CHECK(opened->parts.textures.size() == c.textures);
        CHECK(int(listener.said.size()) == c.said);
        for (const std::string& sentence : listener.said) MESSAGE(sentence);
    }
}
