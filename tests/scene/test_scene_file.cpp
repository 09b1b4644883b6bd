#include <bit>
#include <cmath>
#include <set>
#include <string>

#include "pathscope/core/files.hpp"
#include "pathscope/math/random.hpp"
#include "pathscope/scene/scene_file.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

SceneFile parsed(std::string_view text) {
    const auto scene = parse_scene_file(text, "scene.json");
    REQUIRE_MESSAGE(scene, (scene ? "" : scene.error().message));
    return *scene;
}

std::string error_of(std::string_view text) {
    const auto scene = parse_scene_file(text, "scene.json");
    return scene ? "(no error)" : scene.error().message;
}

/// A scene that is right, with one member more.
std::string with(std::string_view members) { return R"({"obj": "a.obj", )" + std::string(members) + "}"; }

/// Any finite float, of any size.
float any_float(HashRng& rng) {
    for (;;) {
        const float value = std::bit_cast<float>(rng.next_u32());
        if (std::isfinite(value)) return value;
    }
}
float any_positive(HashRng& rng) { return std::abs(any_float(rng)) + 1e-30f; }
Vec3 any_vector(HashRng& rng) { return {any_float(rng), any_float(rng), any_float(rng)}; }
Rgb any_colour(HashRng& rng) { return {any_positive(rng), any_positive(rng), any_positive(rng)}; }
Vec3 small_vector(HashRng& rng) { return {rng.next_float() + 0.1f, rng.next_float(), rng.next_float()}; }

SceneFile any_scene(HashRng& rng) {
    SceneFile scene;
    scene.name = "a \"quoted\" näme";
    scene.objs = {"a.obj", "b c.obj"};
    scene.up_axis = rng.next_float() < 0.5f ? UpAxis::y : UpAxis::z;
    scene.units_to_metres = any_positive(rng);
    scene.exposure_ev = any_float(rng);
    for (const char* name : {"front", "back"}) {
        const Camera view{small_vector(rng), small_vector(rng) + Vec3{5, 0, 0},
                          small_vector(rng) + Vec3{0, 3, 0}, 1 + 170 * rng.next_float()};
        scene.cameras.push_back({name, view, Aspect{4, 3}});
    }
    scene.cameras[1].aspect.reset();
    scene.variants = {{"a.obj", "back"}};
    scene.lights = {
        EmissiveMtlSpec{false},
        QuadLightSpec{any_vector(rng), small_vector(rng), {-small_vector(rng).x, 1, 0}, any_colour(rng)},
        SphereLightSpec{any_vector(rng), any_positive(rng), any_colour(rng)},
        PointLightSpec{any_vector(rng), any_colour(rng)},
        SunSpec{small_vector(rng), any_colour(rng), 180 * rng.next_float()},
        SkySpec{any_colour(rng)},
        EnvmapSpec{"sky.hdr", any_positive(rng), any_float(rng)},
    };
    MaterialOverride material;
    material.model = MaterialKind::thin_glass;
    material.kd = small_vector(rng) * 0.5f;
    material.ks = small_vector(rng) * 0.5f;
    material.ke = any_colour(rng);
    material.roughness = rng.next_float();
    material.metallic = rng.next_float();
    material.ior = 1 + rng.next_float();
    material.opacity = rng.next_float();
    material.map_kd = "a.png";
    material.map_ks = "";
    material.map_ke = "c.png";
    material.map_d = "d.png";
    material.map_roughness = "e.png";
    scene.materials = {{"wood", material}, {"nothing", {}}};
    scene.defaults = {RenderDefaults::Size{640, 360}, 64, 0};
    scene.preview = PreviewSpec{"Some renderer", "Filmic", any_float(rng)};
    return scene;
}

}  // namespace

TEST_CASE("a scene file says what it says, and the rest is the default") {
    const SceneFile least = parsed(R"({"obj": "a.obj"})");
    CHECK(least.objs == std::vector<std::string>{"a.obj"});
    CHECK(least.cameras.empty());
    CHECK(least.lights.empty());
    CHECK(least.units_to_metres == 1);

    const SceneFile scene = parsed(R"({
        "name": "room", "obj": ["a.obj", "b.obj"], "up_axis": "Z", "units_to_metres": 0.01, "exposure_ev": -1,
        "camera": {"position": [1, 2, 3], "look_at": [0, 0, 0]},
        "cameras": [{"name": "side", "position": [9, 0, 0], "look_at": [0, 0, 0], "up": [0, 1, 0],
                     "vfov_deg": 30, "aspect": "4:3"}],
        "variants": {"c.obj": "side"},
        "lights": [{"type": "emissive_mtl"}, {"type": "sun", "to_sun": [0, 2, 0], "irradiance": [1, 2, 3]},
                   {"type": "point", "position": [0, 1, 0], "intensity": [4, 5, 6]},
                   {"type": "sphere", "centre": [0, 1, 0], "radius": 2, "radiance": [4, 5, 6]},
                   {"type": "envmap", "file": "sky.hdr", "rotate_y": 90}],
        "materials": {"wood": {"kd": [0.5, 0.4, 0.3], "model": "lambert", "map_kd": ""}},
        "defaults": {"size": [640, 360], "spp": 16, "bounces": 8}})");
    CHECK(scene.objs.size() == 2);
    CHECK(scene.cameras.size() == 2);
    CHECK(scene.cameras[0].name == "default");
    CHECK(scene.cameras[0].view.up == Vec3{0, 0, 1});
    CHECK(scene.cameras[0].view.vfov_deg == Camera{}.vfov_deg);
    CHECK(scene.cameras[1].aspect == Aspect{4, 3});
    CHECK(std::get<EmissiveMtlSpec>(scene.lights[0]).two_sided);
    CHECK(std::get<SunSpec>(scene.lights[1]).angle_deg == SunSpec{}.angle_deg);
    CHECK(std::get<PointLightSpec>(scene.lights[2]).intensity == Rgb{4, 5, 6});
    CHECK(std::get<SphereLightSpec>(scene.lights[3]).radius == 2);
    CHECK(std::get<EnvmapSpec>(scene.lights[4]).rotate_y == 90);
    const MaterialOverride& wood = scene.materials.at("wood");
    CHECK(wood.model == MaterialKind::lambert);
    CHECK(wood.kd == Rgb{0.5f, 0.4f, 0.3f});
    CHECK(wood.map_kd == "");
    CHECK_FALSE(wood.ks);
    CHECK(scene.defaults.size->height == 360);
    CHECK(scene.defaults.bounces == 8);
}

TEST_CASE("the default camera may stand among the cameras again, but only as the same") {
    const std::string a = R"({"name": "a", "position": [1, 0, 0], "look_at": [0, 0, 0]})";
    const std::string b = R"({"name": "b", "position": [2, 0, 0], "look_at": [0, 0, 0]})";
    const std::string other_a = R"({"name": "a", "position": [2, 0, 0], "look_at": [0, 0, 0]})";
    CHECK(parsed(with(R"("camera": )" + b + R"(, "cameras": [)" + a + "," + b + "]")).cameras[0].name == "b");
    CHECK(parsed(with(R"("camera": )" + b + R"(, "cameras": [)" + a + "," + b + "]")).cameras.size() == 2);
    CHECK(parsed(with(R"("cameras": [)" + a + "," + b + "]")).cameras[0].name == "a");
    CHECK(error_of(with(R"("camera": )" + a + R"(, "cameras": [)" + b + "," + other_a + "]")) ==
          "scene.json: cameras[1]: has the name of the default camera, \"a\", but differs from it.");
    CHECK(error_of(with(R"("cameras": [)" + a + "," + a + "]")) ==
          "scene.json: cameras[1]: there is another camera of the name \"a\".");
}

TEST_CASE("to_json and back gives the same scene, to the last bit of every float") {
    HashRng rng(5);
    for (int i = 0; i < 300; ++i) {
        const SceneFile scene = any_scene(rng);
        const std::string text = to_json(scene);
        const SceneFile back = parsed(text);
        CHECK(back == scene);
        CHECK(to_json(back) == text);
        // The default operator== takes 0 and -0 for equal; the text must not.
        const auto& quad = std::get<QuadLightSpec>(scene.lights[1]);
        const auto& quad_back = std::get<QuadLightSpec>(back.lights[1]);
        CHECK(std::bit_cast<std::uint32_t>(quad.corner.x) ==
              std::bit_cast<std::uint32_t>(quad_back.corner.x));
    }
    CHECK(std::signbit(
        std::get<QuadLightSpec>(parsed(to_json([] {
                                    SceneFile scene;
                                    scene.objs = {"a"};
                                    scene.lights = {QuadLightSpec{{-0.0f, 0, 0}, {1, 0, 0}, {0, 1, 0}, {}}};
                                    return scene;
                                }()))
                                    .lights[0])
            .corner.x));
}

TEST_CASE(
    "the float whose shortest decimals, read as a double, end half-way to the next float comes back too") {
    SceneFile scene;
    scene.objs = {"a.obj"};
    scene.units_to_metres = std::bit_cast<float>(0x15ae43fdu);  // 7.038531e-26
    CHECK(parsed(to_json(scene)).units_to_metres == scene.units_to_metres);
}

TEST_CASE("to_json writes floats as people do") {
    SceneFile scene;
    scene.objs = {"a.obj"};
    scene.exposure_ev = 0.1f;
    CHECK(to_json(scene) ==
          R"({"exposure_ev":0.1,"name":"","obj":["a.obj"],"units_to_metres":1.0,"up_axis":"Y"})");
}

TEST_CASE("what is wrong with a scene file is one sentence that names the place") {
    const std::string quad =
        R"({"type": "quad", "corner": [0, 0, 0], "edge_u": [1, 0, 0], "radiance": [1, 1, 1], )";
    const std::string camera = R"("position": [1, 2, 3], "look_at": [0, 0, 0])";
    struct Case {
        std::string text, error;
    };
    const Case cases[] = {
        // Syntax: line and column.
        {"", "scene.json:1:1: not JSON: syntax error"},
        {"{\n  \"obj\": \"a.obj\",\n  \"name\": }", "scene.json:3:11: not JSON: syntax error"},
        {"{\"obj\": \"a.obj\"", "scene.json:1:16: not JSON: syntax error"},
        {"{\"obj\": \"a.obj\",\n\"exposure_ev\": NaN}", "scene.json:2:16: not JSON: syntax error"},
        {"{\"obj\": \"a.obj\"} x", "scene.json:1:18: not JSON: syntax error"},
        {"{\"obj\": \"\xff\"}", "scene.json:1:10: not JSON: syntax error"},
        {with(R"("exposure_ev": 1e999)"), "number overflow"},
        {R"({"obj": "a.obj", "obj": "b.obj"})", "scene.json: the key \"obj\" stands twice in one object."},
        {with(R"("lights": [{"type": "sky", "radiance": [1, 1, 1], "type": "sun"}])"),
         "the key \"type\" stands twice"},
        // The whole.
        {"[]", "scene.json: must be an object {...}, not a list of 0."},
        {"7", "scene.json: must be an object {...}, not 7."},
        {"{}", "scene.json: \"obj\" is missing."},
        {R"({"obj": 3})", "scene.json: obj: must be a text in quotes, not 3."},
        {R"({"obj": []})", "scene.json: obj: must name at least one OBJ file."},
        {R"({"obj": ["a.obj", ""]})", "scene.json: obj[1]: must name a file."},
        {with(R"("colour": 1)"),
         "scene.json: colour: unknown key; known are camera, cameras, defaults, exposure_ev, lights, "
         "materials, "
         "name, obj, preview, units_to_metres, up_axis, variants."},
        {with(R"("name": null)"), "scene.json: name: must be a text in quotes, not null."},
        {with(R"("up_axis": "X")"), "scene.json: up_axis: must be \"Y\" or \"Z\"."},
        {with(R"("units_to_metres": 0)"), "scene.json: units_to_metres: is 0; it must be above 0."},
        {with(R"("exposure_ev": 1e39)"), "scene.json: exposure_ev: too large for a number."},
        {with(R"("exposure_ev": "1")"), "scene.json: exposure_ev: must be a number, not \"1\"."},
        // Cameras.
        {with(R"("camera": {})"), "scene.json: camera: \"position\" is missing."},
        {with(R"("camera": 5)"), "scene.json: camera: must be an object {...}, not 5."},
        {with(R"("camera": {"position": [1, 2, 3], "look_at": [1, 2, 3]})"),
         "scene.json: camera: The camera's position and look_at are the same point"},
        {with(R"("camera": {"position": [1, 2], "look_at": [1, 2, 3]})"),
         "scene.json: camera.position: must be a list of three numbers, not a list of 2."},
        {with(R"("camera": {"position": [1, "2", 3], "look_at": [1, 2, 3]})"),
         "scene.json: camera.position[1]: must be a number, not \"2\"."},
        {with(R"("camera": {"position": [0, 1, 0], "look_at": [0, 5, 0]})"),
         "scene.json: camera: The camera's up is zero or points along its view"},
        {with(R"("camera": {"up": [0, 0, 0], )" + camera + "}"),
         "scene.json: camera.up: is zero, or too short or long to tell where it points."},
        {with(R"("camera": {"vfov_deg": 180, )" + camera + "}"),
         "scene.json: camera: The camera's vfov_deg is 180"},
        {with(R"("camera": {"vfov_deg": -5, )" + camera + "}"),
         "scene.json: camera: The camera's vfov_deg is -5"},
        {with(R"("camera": {"fov": 50, )" + camera + "}"),
         "scene.json: camera.fov: unknown key; known are aspect, look_at, name, position, up, vfov_deg."},
        {with(R"("camera": {"aspect": "16:0", )" + camera + "}"),
         "scene.json: camera.aspect: must be a shape such as \"16:9\"."},
        {with(R"("camera": {"aspect": "16x9", )" + camera + "}"), "camera.aspect: must be a shape"},
        {with(R"("camera": {"aspect": "16:9 ", )" + camera + "}"), "camera.aspect: must be a shape"},
        {with(R"("camera": {"aspect": 1.5, )" + camera + "}"),
         "camera.aspect: must be a text in quotes, not 1.5."},
        {with(R"("cameras": {})"), "scene.json: cameras: must be a list [...], not an object."},
        {with(R"("variants": {"b.obj": "front"})"),
         "scene.json: variants[\"b.obj\"]: there is no camera \"front\"."},
        // Lights.
        {with(R"("lights": [])"), "scene.json: lights: no light, no image"},
        {with(R"("lights": [{}])"), "scene.json: lights[0]: \"type\" is missing."},
        {with(R"("lights": [{"type": "lamp"}])"),
         "scene.json: lights[0].type: unknown type \"lamp\"; known are emissive_mtl, quad, sphere, point, "
         "sun, sky, "
         "envmap."},
        {with(
             R"("lights": [{"type": "sky", "radiance": [1, 1, 1]}, {"type": "sky", "colour": [1, 1, 1], "radiance": [1, 1, 1]}])"),
         "scene.json: lights[1].colour: unknown key; known are radiance, type."},
        {with(R"("lights": [{"type": "sky", "radiance": [1, -1, 1]}])"),
         "scene.json: lights[0].radiance[1]: is -1; it must be at least 0."},
        {with(R"("lights": [{"type": "sky", "radiance": 1}])"),
         "scene.json: lights[0].radiance: must be a list of three numbers, not 1."},
        {with(R"("lights": [{"type": "emissive_mtl", "two_sided": 1}])"),
         "scene.json: lights[0].two_sided: must be true or false, not 1."},
        {with(R"("lights": [)" + quad + R"("edge_v": [0, 0, 0]}])"), "scene.json: lights[0].edge_v: is zero"},
        {with(R"("lights": [)" + quad + R"("edge_v": [-2, 0, 0]}])"),
         "scene.json: lights[0]: edge_u and edge_v point the same way"},
        {with(R"("lights": [{"type": "sphere", "centre": [0, 0, 0], "radius": -1, "radiance": [1, 1, 1]}])"),
         "scene.json: lights[0].radius: is -1; it must be above 0."},
        {with(R"("lights": [{"type": "sun", "to_sun": [0, 0, 0], "irradiance": [1, 1, 1]}])"),
         "scene.json: lights[0].to_sun: is zero"},
        {with(
             R"("lights": [{"type": "sun", "to_sun": [0, 1, 0], "irradiance": [1, 1, 1], "angle_deg": 181}])"),
         "scene.json: lights[0].angle_deg: is 181; it must lie between 0 and 180."},
        {with(R"("lights": [{"type": "envmap", "file": ""}])"),
         "scene.json: lights[0].file: must name a file."},
        {with(R"("lights": [{"type": "envmap", "file": "a", "scale": -1}])"),
         "scene.json: lights[0].scale: is -1; it must be at least 0."},
        {with(R"("lights": [{"type": "point", "position": [0, 0, 0]}])"),
         "scene.json: lights[0]: \"intensity\" is missing."},
        // Materials.
        {with(R"("materials": {"my wood": {"kd": [0.5, 1.5, 0]}})"),
         "scene.json: materials[\"my wood\"].kd[1]: is 1.5; it must lie between 0 and 1."},
        {with(R"("materials": {"a": {"model": "glass"}})"),
         "scene.json: materials[\"a\"].model: must be one of standard, lambert, mirror, dielectric, "
         "thin_glass."},
        {with(R"("materials": {"a": {"Kd": [0, 0, 0]}})"),
         "scene.json: materials[\"a\"].Kd: unknown key; known are"},
        {with(R"("materials": {"a": {"roughness": 2}})"),
         "scene.json: materials[\"a\"].roughness: is 2; it must lie between 0 and 1."},
        {with(R"("materials": {"a": {"ior": 0.5}})"),
         "scene.json: materials[\"a\"].ior: is 0.5; it must lie between 1 and 10."},
        {with(R"("materials": [])"), "scene.json: materials: must be an object {...}, not a list of 0."},
        // Defaults and preview.
        {with(R"("defaults": {"size": [640]})"),
         "scene.json: defaults.size: must be a list of width and height."},
        {with(R"("defaults": {"size": [640, -360]})"),
         "scene.json: defaults.size[1]: is -360; it must lie between 1 and 65536."},
        {with(R"("defaults": {"size": "640x360"})"), "scene.json: defaults.size: must be a list [...]"},
        {with(R"("defaults": {"spp": 1.5})"), "scene.json: defaults.spp: must be a whole number, not 1.5."},
        {with(R"("defaults": {"spp": 0})"), "scene.json: defaults.spp: is 0; it must lie between 1 and"},
        {with(R"("defaults": {"spp": 99999999999999999999})"),
         "scene.json: defaults.spp: must be a whole number"},
        {with(R"("defaults": {"spp": 9999999999})"),
         "scene.json: defaults.spp: is 9999999999; it must lie between"},
        {with(R"("defaults": {"depth": 3})"),
         "scene.json: defaults.depth: unknown key; known are bounces, size, spp."},
        {with(R"("preview": {"gamma": 3})"),
         "scene.json: preview.gamma: unknown key; known are exposure_ev, renderer, view_transform."},
    };
    for (const Case& c : cases) {
        CAPTURE(c.text);
        CAPTURE(error_of(c.text));
        CHECK(error_of(c.text).find(c.error) != std::string::npos);
        CHECK(error_of(c.text).starts_with("scene.json:"));
        CHECK(error_of(c.text).ends_with("."));
        CHECK(error_of(c.text).find('\n') == std::string::npos);
    }
}

TEST_CASE("no text crashes the reader") {
    const std::string good = to_json([] {
        HashRng rng(1);
        return any_scene(rng);
    }());
    HashRng rng(2);
    for (int i = 0; i < 3000; ++i) {
        std::string text = good;
        for (int k = 0; k < 3; ++k) text[rng.next_u32() % text.size()] = char(rng.next_u32());
        if (i % 3 == 0) text.resize(rng.next_u32() % text.size());
        const auto scene = parse_scene_file(text, "scene.json");
        if (scene) CHECK(*parse_scene_file(to_json(*scene), "again") == *scene);
    }
    CHECK(error_of(std::string(100'000, '[')).find("not JSON") != std::string::npos);
}

TEST_CASE("every scene of the shared folder is understood") {
    const auto folder = testing::shared_folder();
    if (folder.empty()) {
        MESSAGE("skipped: no ../shared");
        return;
    }
    int scenes = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "scenes")) {
        const auto path = entry.path() / "scene.json";
        if (!std::filesystem::exists(path)) continue;
        CAPTURE(path);
        const auto text = read_file(path);
        REQUIRE(text);
        const SceneFile scene = parsed(*text);
        CHECK(scene.name == entry.path().filename());
        CHECK_FALSE(scene.cameras.empty());
        CHECK_FALSE(scene.lights.empty());
        CHECK(parsed(to_json(scene)) == scene);
        ++scenes;
    }
    CHECK(scenes == 8);
}
