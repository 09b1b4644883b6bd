#include "pathscope/scene/load.hpp"

#include <algorithm>
#include <fstream>
#include <map>
#include <string>

#include "pathscope/core/files.hpp"
#include "pathscope/image/io.hpp"

#include "log_capture.hpp"
#include "memory_files.hpp"
#include "testing.hpp"

#include "scene/loading.hpp"

using namespace pathscope;
using namespace pathscope::testing;
namespace fs = std::filesystem;

namespace {

/// The one material of a triangle whose MTL has these statements.
Material material_of(const std::string& statements, const SceneOptions& options = {},
                     const SceneFile& more = {}) {
    testing::MemoryFiles files{{"a.obj", triangle("mtllib a.mtl\nusemtl m\n")},
                               {"a.mtl", "newmtl m\n" + statements}};
    SceneFile scene = more;
    scene.objs = {"a.obj"};
    const LogCapture quiet;
    const SceneParts parts = parts_of(scene, files, options);
    REQUIRE(parts.materials.size() == 1);
    return parts.materials[0];
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
    const LogCapture listener;
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
    const LogCapture listener;
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
    const LogCapture listener;
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
    const LogCapture listener;
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
    const LogCapture listener;
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
