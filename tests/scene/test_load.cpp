#include <algorithm>
#include <fstream>
#include <map>
#include <string>

#include "pathscope/core/files.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/image/io.hpp"
#include "pathscope/scene/load.hpp"

#include "memory_files.hpp"
#include "testing.hpp"

#include "scene/same_parts.hpp"

using namespace pathscope;
namespace fs = std::filesystem;

namespace {

/// All that is said while it lives.
class Listener {
  public:
    Listener() {
        before_ = set_log_sink([this](LogLevel level, std::string_view sentence) {
            said.push_back((level == LogLevel::warning ? "warning: " : "note: ") + std::string(sentence));
        });
    }
    ~Listener() { set_log_sink(before_); }
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;

    [[nodiscard]] int count(std::string_view part) const {
        return int(std::count_if(said.begin(), said.end(),
                                 [part](const auto& s) { return s.find(part) != std::string::npos; }));
    }
    std::vector<std::string> said;

  private:
    LogSink before_;
};

SceneFile scene_of(std::vector<std::string> objs) {
    SceneFile scene;
    scene.objs = std::move(objs);
    return scene;
}

SceneParts parts_of(const SceneFile& scene, FileSource& files, const SceneOptions& options = {}) {
    auto parts = load_scene_parts(scene, files, options);
    REQUIRE_MESSAGE(parts, (parts ? "" : parts.error().message));
    return std::move(*parts);
}

std::string error_of(const SceneFile& scene, FileSource& files) {
    const auto parts = load_scene_parts(scene, files, {});
    return parts ? "(no error)" : parts.error().message;
}

std::string triangle(const std::string& head = "") { return head + "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"; }

/// The one material of a triangle whose MTL has these statements.
Material material_of(const std::string& statements, const SceneOptions& options = {},
                     const SceneFile& more = {}) {
    testing::MemoryFiles files{{"a.obj", triangle("mtllib a.mtl\nusemtl m\n")},
                               {"a.mtl", "newmtl m\n" + statements}};
    SceneFile scene = more;
    scene.objs = {"a.obj"};
    const Listener quiet;
    const SceneParts parts = parts_of(scene, files, options);
    REQUIRE(parts.materials.size() == 1);
    return parts.materials[0];
}

/// A TGA of one pixel (blue, green, red, alpha), the smallest image file there is.
std::string tga(std::vector<std::uint8_t> bgra) {
    std::string bytes(18, '\0');
    bytes[2] = 2;
    bytes[12] = bytes[14] = 1;
    bytes[16] = char(8 * bgra.size());
    bytes.append(bgra.begin(), bgra.end());
    return bytes;
}

void write(const fs::path& path, std::string_view bytes) {
    fs::create_directories(path.parent_path());
    REQUIRE(write_file_atomically(path, bytes));
}

}  // namespace

TEST_CASE("several OBJ files become one mesh; what one lacks is zero there") {
    testing::MemoryFiles files{
        {"a.obj", triangle("mtllib m.mtl\nusemtl red\n")},
        {"sub/b.obj", triangle("mtllib ../m.mtl\nusemtl green\nvt 0.5 0.5\nvn 0 0 1\n") +
                          "usemtl red\nf 1/1/1 2/1/1 3/1/1\n"},
        {"m.mtl", "newmtl red\nKd 1 0 0\nnewmtl unused\nnewmtl green\nKd 0 1 0\n"}};
    const SceneParts parts = parts_of(scene_of({"a.obj", "sub/b.obj"}), files);
    CHECK(parts.mesh.triangles.size() == 3);
    CHECK(parts.mesh.positions.size() == 3 + 6);
    REQUIRE(parts.mesh.uvs.size() == 9);
    REQUIRE(parts.mesh.normals.size() == 9);
    CHECK(parts.mesh.uvs[0] == Vec2{});
    CHECK(parts.mesh.normals[parts.mesh.triangles[2].a] == Vec3{0, 0, 1});
    CHECK(parts.mesh.triangles[2].a >= 3);
    REQUIRE(parts.materials.size() == 2);
    CHECK(parts.materials[0].name == "red");
    CHECK(parts.mesh.materials == std::vector<std::uint32_t>{0, 1, 0});
}

TEST_CASE("a mtllib line names one file with blanks, or several") {
    testing::MemoryFiles files{{"a.obj", "mtllib a b.mtl\nusemtl x\n" + triangle()},
                               {"b.obj", "mtllib c.mtl d.mtl missing.mtl\nusemtl y\n" + triangle()},
                               {"a b.mtl", "newmtl x\nKd 1 0 0\n"},
                               {"c.mtl", "newmtl x\n"},
                               {"d.mtl", "newmtl y\nKd 0 1 0\n"}};
    const Listener listener;
    const SceneParts parts = parts_of(scene_of({"a.obj", "b.obj"}), files);
    CHECK(parts.materials[0].kd == Rgb{1, 0, 0});
    CHECK(parts.materials[1].kd == Rgb{0, 1, 0});
    CHECK(listener.said.empty());
}

TEST_CASE("missing materials are grey, and said once") {
    testing::MemoryFiles files{
        {"bare.obj", triangle()},
        {"lost.obj", "mtllib lost.mtl\nusemtl x\n" + triangle()},
        {"other.obj", "mtllib a.mtl\n" + triangle() + "usemtl x\nf 1 2 3\nusemtl y\nf 1 2 3\n"},
        {"a.mtl", "newmtl x\nKd 1 0 0\n"}};
    const Listener listener;
    const SceneParts parts = parts_of(scene_of({"bare.obj", "lost.obj", "other.obj"}), files);
    REQUIRE(parts.materials.size() == 5);
    for (const std::size_t grey : {0, 1, 2, 4}) {
        CHECK(parts.materials[grey].kd == Rgb{0.5f, 0.5f, 0.5f});
        CHECK(parts.materials[grey].kind == MaterialKind::lambert);
    }
    CHECK(listener.said == std::vector<std::string>{
                               "note: bare.obj names no MTL file (mtllib); its surfaces are grey.",
                               "warning: lost.mtl: there is no such file, so its materials are missing.",
                               "warning: other.obj has faces before any usemtl; they are grey.",
                               "warning: other.obj: its MTL has no material \"y\"; what uses it is grey."});
}

TEST_CASE("a metal's colour becomes its F0, however it is written") {
    const Material by_ks = material_of("Kd 0 0 0\nKs 0.9 0.8 0.7\nPm 1\nPr 0.3\nillum 3\n");
    CHECK(by_ks.ks == Rgb{0.9f, 0.8f, 0.7f});
    CHECK(by_ks.kd == Rgb{});
    const Material by_kd = material_of("Kd 0.9 0.8 0.7\nPm 1\nPr 0.3\n");
    CHECK(by_kd.ks == Rgb{0.9f, 0.8f, 0.7f});
    CHECK(by_kd.kd == Rgb{});
    const Material half = material_of("Kd 0.8 0.8 0.8\nKs 0.2 0.2 0.2\nPm 0.5\n");
    CHECK(half.ks.x == doctest::Approx(0.5));
    CHECK(half.kd.x == doctest::Approx(0.4));
}

TEST_CASE("each kind keeps only what it uses") {
    const Material glass =
        material_of("Kd 0.01 0.01 0.01\nKs 0.3 0.3 0.3\nTf 0.1 0.1 0.1\nNi 2.5\nillum 7\nd 0.5\n");
    CHECK(glass.kind == MaterialKind::dielectric);
    CHECK(glass.kd == Rgb{});
    CHECK(glass.ks == Rgb{});
    CHECK(glass.ior == 2.5f);
    CHECK(glass.opacity == 1);
    const Material mirror = material_of("Kd 0.01 0.01 0.01\nKs 0.95 0.95 0.95\nillum 5\n");
    CHECK(mirror.kd == Rgb{});
    CHECK(mirror.ks == Rgb{0.95f, 0.95f, 0.95f});
    CHECK(material_of("Kd 0.5 0.5 0.5\nKs 1 1 1\nillum 1\n").ks == Rgb{});
    CHECK(material_of("Kd 0.5 0.5 0.5\nKs 0.2 0.2 0.2\nd 0.5\n").opacity == 0.5f);
}

TEST_CASE("the model lambert takes every surface as Kd; emitters emit and reflect nothing") {
    const SceneOptions lambert{MaterialModel::lambert, true};
    for (const char* statements :
         {"Kd 0.5 0.4 0.3\nKs 1 1 1\nillum 2\nd 0.5\n", "Kd 0.5 0.4 0.3\nKs 1 1 1\nillum 5\n",
          "Kd 0.5 0.4 0.3\nillum 7\nNi 2\n", "Kd 0.5 0.4 0.3\nPm 1\nPr 0\n"}) {
        const Material m = material_of(statements, lambert);
        CHECK(m.kind == MaterialKind::lambert);
        CHECK(m.kd == Rgb{0.5f, 0.4f, 0.3f});
        CHECK(m.ks == Rgb{});
        CHECK(m.opacity == 1);
        CHECK_FALSE(m.emits());
    }
    const Material light = material_of("Kd 0.78 0.78 0.78\nKe 17 12 4\n", lambert);
    CHECK(light.ke == Rgb{17, 12, 4});
    CHECK(light.kd == Rgb{});
}

TEST_CASE("Ke emits as the scene file says") {
    SceneFile scene;
    CHECK(material_of("Ke 1 1 1\n").emits());
    CHECK(material_of("Ke 1 1 1\n").two_sided_emission);
    scene.lights = {SkySpec{{1, 1, 1}}};
    CHECK_FALSE(material_of("Ke 1 1 1\n", {}, scene).emits());
    scene.lights = {SkySpec{{1, 1, 1}}, EmissiveMtlSpec{false}};
    CHECK(material_of("Ke 1 1 1\n", {}, scene).emits());
    CHECK_FALSE(material_of("Ke 1 1 1\n", {}, scene).two_sided_emission);
}

TEST_CASE("overrides replace values and maps") {
    SceneFile scene;
    MaterialOverride& o = scene.materials["m"];
    const std::string mtl = "Kd 0.5 0.5 0.5\nKs 0.1 0.1 0.1\nNs 10\nNi 1.2\nmap_Kd missing.png\n";

    CHECK(material_of(mtl, {}, scene) == material_of(mtl));
    o.kd = Rgb{1, 0, 0};
    o.roughness = 0.25f;
    o.opacity = 0.5f;
    o.ior = 1.7f;
    o.ke = Rgb{3, 3, 3};
    Material m = material_of(mtl, {}, scene);
    CHECK(m.kd == Rgb{1, 0, 0});
    CHECK(m.ks == Rgb{0.1f, 0.1f, 0.1f});
    CHECK(m.roughness == 0.25f);
    CHECK(m.opacity == 0.5f);
    CHECK(m.ior == 1.7f);
    CHECK(m.emits());

    scene.lights = {SkySpec{{1, 1, 1}}};
    CHECK(material_of(mtl + "Ke 1 1 1\n", {}, scene).ke ==
          Rgb{3, 3, 3});  // An override is asked for by name.
    o = {};
    o.model = MaterialKind::mirror;
    CHECK(material_of("Kd 1 1 1\n", {}, scene).ks == Rgb{1, 1, 1});
    o.metallic = 1.0f;
    o.model = MaterialKind::standard;
    CHECK(material_of(mtl, {}, scene).ks == Rgb{0.5f, 0.5f, 0.5f});
}

TEST_CASE("an override of a material that no MTL has is an error that names those there are") {
    testing::MemoryFiles files{{"a.obj", triangle("mtllib a.mtl\nusemtl m\n")},
                               {"a.mtl", "newmtl m\nnewmtl unused\n"}};
    SceneFile scene = scene_of({"a.obj"});
    scene.materials["n"] = {};
    CHECK(error_of(scene, files) ==
          "materials[\"n\"] of the scene file: no MTL of this scene has a material of this name; there are "
          "m, unused.");
    scene.materials = {{"unused", {}}};
    CHECK(error_of(scene, files) == "(no error)");
}

TEST_CASE("textures: found from the MTL, shared by name and usage, scaled by use") {
    testing::MemoryFiles files{
        {"o/a.obj", "mtllib m/a.mtl\n" + triangle("usemtl a\n") + "usemtl b\nf 1 2 3\n"},
        {"o/m/a.mtl",
         "newmtl a\nKd 1 1 1\nmap_Kd t\\red.tga\nmap_d t/red.tga\nnewmtl b\nmap_Kd -s 2 3 1 -o 0.5 0 0 "
         "./t/red.tga\nmap_Ks t/blue.tga\n"},
        {"o/m/t/red.tga", tga({0, 0, 255, 51})},
        {"o/m/t/blue.tga", tga({255, 0, 0})},
        {"blue.tga", tga({255, 0, 0})}};
    const Listener listener;
    SceneFile scene = scene_of({"o/a.obj"});
    const SceneParts parts = parts_of(scene, files);
    CHECK(listener.said.empty());
    REQUIRE(parts.textures.size() == 3);
    const Material &a = parts.materials[0], &b = parts.materials[1];
    CHECK(parts.textures[std::size_t(a.map_kd.index)].eval({}) == Rgb{1, 0, 0});
    CHECK(parts.textures[std::size_t(a.map_d.index)].eval_grey({}) == doctest::Approx(0.2));
    CHECK(b.map_kd.index == a.map_kd.index);
    CHECK(b.map_kd.at({1, 1}) == Vec2{2.5f, 3});
    CHECK(parts.textures[std::size_t(b.map_ks.index)].eval({}) == Rgb{0, 0, 1});
    CHECK_FALSE(a.map_ks);

    // Names of overrides are relative to the scene; a value takes the map away.
    scene.materials["a"].map_kd = "blue.tga";
    scene.materials["b"].kd = Rgb{0.5f, 0.5f, 0.5f};
    const SceneParts changed = parts_of(scene, files);
    CHECK(changed.textures[std::size_t(changed.materials[0].map_kd.index)].eval({}) == Rgb{0, 0, 1});
    CHECK_FALSE(changed.materials[1].map_kd);

    // A lambert render needs no specular map.
    CHECK(parts_of(scene_of({"o/a.obj"}), files, {MaterialModel::lambert, true}).textures.size() == 2);
}

TEST_CASE("a textured metal is tinted by its texture") {
    testing::MemoryFiles files{{"a.obj", triangle("mtllib a.mtl\nusemtl m\n")},
                               {"a.mtl", "newmtl m\nKd 0.5 0.5 0.5\nPm 1\nmap_Kd red.tga\n"},
                               {"red.tga", tga({0, 0, 255})}};
    const Material m = parts_of(scene_of({"a.obj"}), files).materials[0];
    CHECK(m.ks == Rgb{0.5f, 0.5f, 0.5f});
    CHECK(m.map_ks.index == 0);
    CHECK_FALSE(m.map_kd);
}

TEST_CASE("a texture that is missing or broken is said once, and its materials do without") {
    testing::MemoryFiles files{{"a.obj", "mtllib a.mtl\n" + triangle("usemtl a\n") + "usemtl b\nf 1 2 3\n"},
                               {"a.mtl",
                                "newmtl a\nKd 0.5 0.5 0.5\nmap_Kd no.png\nmap_d no.png\nnewmtl b\nmap_Kd "
                                "no.png\nmap_Ks bad.png\nmap_Ke good.tga\n"},
                               {"bad.png", "this is no PNG"},
                               {"good.tga", tga({255, 255, 255})}};
    const Listener listener;
    const SceneParts parts = parts_of(scene_of({"a.obj"}), files);
    CHECK(parts.textures.size() == 1);
    CHECK(parts.materials[0].kd == Rgb{0.5f, 0.5f, 0.5f});
    CHECK_FALSE(parts.materials[0].map_kd);
    CHECK_FALSE(parts.materials[0].map_d);
    CHECK_FALSE(parts.materials[1].map_ks);
    CHECK(parts.materials[1].map_ke.index == 0);
    CHECK(listener.count("warning: no.png: there is no such file. What uses this texture") == 1);
    CHECK(listener.count("bad.png") == 1);
    CHECK(listener.said.size() == 2);
}

TEST_CASE("triangles without area are left out, and counted in one warning for a file") {
    testing::MemoryFiles files{{"a.obj", "mtllib a.mtl\nusemtl m\n" + triangle() + "f 1 1 2\nf 2 2 3\n"},
                               {"flat.obj", "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nf 1 2 1\n"},
                               {"a.mtl", "newmtl m\n"}};
    const Listener listener;
    CHECK(parts_of(scene_of({"a.obj", "flat.obj"}), files).degenerate_triangles == 3);
    CHECK(listener.said == std::vector<std::string>{"warning: a.obj: 2 triangles without area left out.",
                                                    "warning: flat.obj: 1 triangle without area left out."});
    CHECK(error_of(scene_of({"flat.obj"}), files) == "flat.obj: no triangle of this mesh has an area.");
}

TEST_CASE("an environment map is decoded, and only one is possible") {
    testing::MemoryFiles files{
        {"a.obj", triangle("mtllib a.mtl\nusemtl m\n")},
        {"a.mtl", "newmtl m\n"},
        {"sky.pfm", std::string("PF\n1 1\n-1.0\n") + std::string("\0\0\0\x40\0\0\x80\x3f\0\0\0\0", 12)}};
    SceneFile scene = scene_of({"a.obj"});
    scene.lights = {EnvmapSpec{"sky.pfm", 2, 90}};
    const SceneParts parts = parts_of(scene, files);
    REQUIRE(parts.envmap);
    CHECK(parts.envmap->at(0, 0) == Rgb{2, 1, 0});
    scene.lights.emplace_back(EnvmapSpec{"sky.pfm", 1, 0});
    CHECK(error_of(scene, files).find("two lights of type envmap") != std::string::npos);
    scene.lights = {EnvmapSpec{"none.hdr", 1, 0}};
    CHECK(error_of(scene, files) == "none.hdr: there is no such file.");
}

TEST_CASE("what is wrong with a file of a scene is named with its path") {
    const testing::TemporaryFolder folder;
    write(folder.path() / "sub" / "A.obj", triangle("mtllib a.mtl\nusemtl m\n") + "f 1 2 9\n");
    DiskFiles files(folder.path());
    CHECK(error_of(scene_of({"sub\\a.obj"}), files) ==
          (folder.path() / "sub/A.obj").string() +
              ":7: a face has the vertex index 9, but the file has only 3 \"v\" lines.");
    CHECK(error_of(scene_of({"b.obj"}), files) ==
          (folder.path() / "b.obj").string() + ": there is no such file.");
    write(folder.path() / "b.obj", triangle("mtllib b.mtl\nusemtl m\n"));
    write(folder.path() / "b.mtl", "newmtl m\nKd x\n");
    CHECK(error_of(scene_of({"b.obj"}), files) ==
          (folder.path() / "b.mtl").string() + ":2: Kd needs a number, and \"x\" is none.");
}

TEST_CASE("a scene loads into the same bits from a folder and from a manifest") {
    const testing::TemporaryFolder folder, cache;
    write(folder.path() / "room.obj",
          "mtllib Room Parts.MTL\n" + triangle("vt 0.1 0.2\nusemtl m\ns 1\n") + "f 1/1 2/1 3/1\n");
    write(folder.path() / "room parts.mtl",
          "newmtl m\nKd 0.3 0.3 0.3\nmap_Kd Maps\\RED.tga\nmap_Ks none.png\nKe 1 2 3\n");
    write(folder.path() / "maps" / "red.TGA", tga({1, 2, 200, 50}));
    write(folder.path() / "unrelated.txt", "private");
    const Listener quiet;
    const auto opened = open_scene(folder.path() / "room.obj", {});
    REQUIRE(opened);

    const Manifest manifest = opened->files->manifest();
    CHECK(manifest.files.size() == 3);
    CHECK(manifest.missing == std::vector<std::string>{"none.png"});
    for (const ManifestEntry& entry : manifest.files)
        fs::copy_file(*opened->files->path_of(entry.name), cache.path() / to_hex(entry.hash));
    ManifestFiles sent(manifest, [&](const Digest& hash) { return cache.path() / to_hex(hash); });
    const auto scene = parse_scene_file(to_json(opened->file), "state");
    REQUIRE(scene);
    testing::check_same(parts_of(*scene, sent), opened->parts);

    // Other options need other files: that is an error on the server, not a silent difference.
    ManifestFiles other({}, [&](const Digest&) { return cache.path(); });
    CHECK(error_of(*scene, other).find("room.obj: the client did not list this file") != std::string::npos);
}

TEST_CASE("a bare OBJ gets a camera that sees it and, where nothing emits, a sky; both are said") {
    const testing::TemporaryFolder folder;
    write(folder.path() / "dark.obj", triangle("mtllib a.mtl\nusemtl dark\n"));
    write(folder.path() / "bright.OBJ", triangle("mtllib a.mtl\nusemtl bright\n"));
    write(folder.path() / "a.mtl", "newmtl dark\nKd 1 1 1\nnewmtl bright\nKe 1 1 1\n");
    const Listener listener;
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
    const Listener listener;
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
    const Listener quiet;
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
        const Listener listener;
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
        const Listener listener;
        const auto opened = open_scene(folder / "scenes" / c.path, {});
        REQUIRE_MESSAGE(opened, (opened ? "" : opened.error().message));
        CHECK(opened->parts.mesh.triangles.size() + opened->parts.degenerate_triangles == c.triangles);
        CHECK(opened->parts.materials.size() == c.materials);
        CHECK(opened->parts.textures.size() == c.textures);
        CHECK(int(listener.said.size()) == c.said);
        for (const std::string& sentence : listener.said) MESSAGE(sentence);
    }
}
