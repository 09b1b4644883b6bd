#include <string>

#include "pathscope/scene/load.hpp"

#include "log_capture.hpp"
#include "testing.hpp"

#include "scene/loading.hpp"

using namespace pathscope;
using namespace pathscope::testing;

TEST_CASE("a bare OBJ gets a camera that sees it and, where nothing emits, a sky; both are said") {
    const testing::TemporaryFolder folder;
    write(folder.path() / "dark.obj", triangle("mtllib a.mtl\nusemtl dark\n"));
    write(folder.path() / "bright.OBJ", triangle("mtllib a.mtl\nusemtl bright\n"));
    write(folder.path() / "a.mtl", "newmtl dark\nKd 1 1 1\nnewmtl bright\nKe 1 1 1\n");
    const LogCapture listener;
    const auto dark = open_scene(folder.path() / "dark.obj", {});
    REQUIRE(dark);
    CHECK(dark->file.name == "dark");
    REQUIRE(dark->file.cameras.size() == 1);
    CHECK(check_camera(dark->file.cameras[0].view));
    CHECK(dark->file.cameras[0].view.look_at == Vec3{0.5f, 0.5f, 0});
    REQUIRE(dark->file.lights.size() == 2);
    CHECK(std::holds_alternative<SkySpec>(dark->file.lights[1]));
    CHECK(listener.count("note: No camera is named; it is put at") == 1);
    CHECK(listener.count("note: No light is named and no material emits; a sky of radiance 1") == 1);

    const auto bright = open_scene(folder.path() / "bright.OBJ", {});
    REQUIRE(bright);
    CHECK(bright->file.lights.size() == 1);
    CHECK(bright->parts.materials[0].emits());
}

TEST_CASE("a bare OBJ that a scene.json beside it names takes camera and lights from there") {
    const testing::TemporaryFolder folder;
    for (const char* name : {"own.obj", "variant.obj", "other.obj"})
        write(folder.path() / name, triangle("mtllib a.mtl\nusemtl m\n"));
    write(folder.path() / "a.mtl", "newmtl m\nKd 1 1 1\n");
    write(folder.path() / "scene.json", R"({"name": "s", "obj": "own.obj", "cameras": [
        {"name": "a", "position": [0, 0, 1], "look_at": [0, 0, 0]},
        {"name": "b", "position": [0, 0, 2], "look_at": [0, 0, 0]}], "variants": {"variant.obj": "b"},
        "lights": [{"type": "sky", "radiance": [2, 2, 2]}], "materials": {"m": {"kd": [0.25, 0, 0]}}})");
    const LogCapture listener;
    const auto own = open_scene(folder.path() / "own.obj", {});
    const auto variant = open_scene(folder.path() / "variant.obj", {});
    const auto other = open_scene(folder.path() / "other.obj", {});
    REQUIRE(own);
    REQUIRE(variant);
    REQUIRE(other);
    CHECK(own->file.cameras[0].name == "a");
    CHECK(own->parts.materials[0].kd == Rgb{0.25f, 0, 0});
    CHECK(variant->file.cameras[0].name == "b");
    CHECK(variant->file.name == "variant");
    CHECK(std::get<SkySpec>(variant->file.lights[0]).radiance == Rgb{2, 2, 2});
    CHECK(variant->parts.materials[0].kd == Rgb{1, 1, 1});
    CHECK(other->file.cameras[0].name == "chosen");
    CHECK(listener.count("note: Camera and lights of") == 2);

    write(folder.path() / "scene.json", "{");
    CHECK(open_scene(folder.path() / "own.obj", {}));
    CHECK(listener.count("warning: " + (folder.path() / "scene.json").string() + ":1:2: not JSON") == 1);
}

TEST_CASE("open_scene refuses what is no scene, in a sentence") {
    const testing::TemporaryFolder folder;
    write(folder.path() / "a.txt", "x");
    write(folder.path() / "bad.json", "{\"obj\": 1}");
    write(folder.path() / "lost.json", "{\"obj\": \"none.obj\"}");
    write(folder.path() / "latin\xe9.obj", triangle());
    const LogCapture quiet;
    const auto message = [&](const char* name) {
        const auto opened = open_scene(folder.path() / name, {});
        REQUIRE_FALSE(opened);
        CHECK(opened.error().kind == ErrorKind::bad_input);
        return opened.error().message;
    };
    const std::string root = folder.path().string() + "/";
    CHECK(message("a.txt") == root + "a.txt is neither a scene file (.json) nor an OBJ (.obj).");
    CHECK(message("none.obj") == root + "none.obj: there is no such file.");
    CHECK(message("none.json").find(root + "none.json") != std::string::npos);
    CHECK(message("bad.json") == root + "bad.json: obj: must be a text in quotes, not 1.");
    CHECK(message("lost.json") == root + "none.obj: there is no such file.");
    CHECK(message("latin\xe9.obj").find("is not UTF-8; rename it.") != std::string::npos);
}
