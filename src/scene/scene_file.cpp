#include "pathscope/scene/scene_file.hpp"

#include <charconv>
#include <set>

#include "json_reader.hpp"

namespace pathscope {
namespace {

using nlohmann::json;

constexpr float k_any = std::numeric_limits<float>::max();
constexpr int k_max_side = 65'536;
constexpr int k_max_spp = 1 << 20;  // The exact sums of image/exact_sum.hpp hold that many.
constexpr int k_max_bounces = 1'000'000;

// ---- From JSON -----------------------------------------------------------------------------------------------

std::string read_file_name(const JsonReader& value) {
    std::string name = value.text();
    if (name.empty()) value.fail("must name a file.");
    return name;
}

std::vector<std::string> read_objs(const JsonReader& value) {
    if (!value.is_list()) return {read_file_name(value)};
    std::vector<std::string> names;
    for (const JsonReader& element : value.elements()) names.push_back(read_file_name(element));
    if (names.empty()) value.fail("must name at least one OBJ file.");
    return names;
}

UpAxis read_up_axis(const JsonReader& value) {
    const std::string text = value.text();
    if (text != "Y" && text != "Z") value.fail("must be \"Y\" or \"Z\".");
    return text == "Z" ? UpAxis::z : UpAxis::y;
}

Aspect read_aspect(const JsonReader& value) {
    const std::string text = value.text();
    const char* end = text.data() + text.size();
    Aspect aspect{0, 0};
    const auto width = std::from_chars(text.data(), end, aspect.width);
    if (width.ec == std::errc{} && width.ptr != end && *width.ptr == ':') {
        const auto height = std::from_chars(width.ptr + 1, end, aspect.height);
        if (height.ptr != end) aspect.height = 0;
    }
    if (aspect.width <= 0 || aspect.height <= 0) {
        value.fail("must be a shape such as \"16:9\".");
        return {};
    }
    return aspect;
}

CameraSpec read_camera(JsonReader value, UpAxis up_axis) {
    CameraSpec camera;
    camera.name = "default";
    camera.view.up = up_direction(up_axis);
    if (auto name = value.find("name")) camera.name = name->text();
    camera.view.position = value.need("position").vector();
    camera.view.look_at = value.need("look_at").vector();
    if (auto up = value.find("up")) camera.view.up = up->direction();
    if (auto vfov = value.find("vfov_deg")) camera.view.vfov_deg = vfov->number();
    if (auto aspect = value.find("aspect")) camera.aspect = read_aspect(*aspect);
    value.refuse_unknown_keys();
    if (const auto fine = check_camera(camera.view); !fine) value.fail(fine.error().message);
    return camera;
}

/// `camera` is the default view and comes first; it may stand among `cameras` again.
std::vector<CameraSpec> read_cameras(JsonReader& scene, UpAxis up_axis) {
    std::vector<CameraSpec> cameras;
    if (auto camera = scene.find("camera")) cameras.push_back(read_camera(*camera, up_axis));
    auto list = scene.find("cameras");
    if (!list) return cameras;
    std::set<std::string> names;
    for (const JsonReader& element : list->elements()) {
        CameraSpec camera = read_camera(element, up_axis);
        if (!names.insert(camera.name).second)
            element.fail(fmt::format("there is another camera of the name \"{}\".", camera.name));
        const bool is_default = !cameras.empty() && camera.name == cameras[0].name;
        if (is_default && camera != cameras[0])
            element.fail(
                fmt::format("has the name of the default camera, \"{}\", but differs from it.", camera.name));
        if (!is_default) cameras.push_back(std::move(camera));
    }
    return cameras;
}

std::map<std::string, std::string> read_variants(const JsonReader& value, const SceneFile& scene) {
    std::map<std::string, std::string> variants;
    for (const auto& [obj, camera] : value.entries()) {
        variants[obj] = camera.text();
        if (!find_camera(scene, variants[obj]))
            camera.fail(fmt::format("there is no camera \"{}\".", variants[obj]));
    }
    return variants;
}

LightSpec read_emissive_mtl(JsonReader& value) {
    EmissiveMtlSpec light;
    if (auto two_sided = value.find("two_sided")) light.two_sided = two_sided->boolean();
    return light;
}

LightSpec read_quad(JsonReader& value) {
    QuadLightSpec light;
    light.corner = value.need("corner").vector();
    light.edge_u = value.need("edge_u").direction();
    light.edge_v = value.need("edge_v").direction();
    light.radiance = value.need("radiance").colour();
    if (!(length_squared(cross(light.edge_u, light.edge_v)) > 0))
        value.fail("edge_u and edge_v point the same way, so the light has no area.");
    return light;
}

LightSpec read_sphere(JsonReader& value) {
    SphereLightSpec light;
    light.centre = value.need("centre").vector();
    light.radius = value.need("radius").positive_number();
    light.radiance = value.need("radiance").colour();
    return light;
}

LightSpec read_point(JsonReader& value) {
    PointLightSpec light;
    light.position = value.need("position").vector();
    light.intensity = value.need("intensity").colour();
    return light;
}

LightSpec read_sun(JsonReader& value) {
    SunSpec light;
    light.to_sun = value.need("to_sun").direction();
    light.irradiance = value.need("irradiance").colour();
    if (auto angle = value.find("angle_deg")) light.angle_deg = angle->number_in(0, 180);
    return light;
}

LightSpec read_sky(JsonReader& value) { return SkySpec{value.need("radiance").colour()}; }

LightSpec read_envmap(JsonReader& value) {
    EnvmapSpec light;
    light.file = read_file_name(value.need("file"));
    if (auto scale = value.find("scale")) light.scale = scale->number_in(0, k_any);
    if (auto rotate_y = value.find("rotate_y")) light.rotate_y = rotate_y->number();
    return light;
}

/// The table that reading, writing and error sentences share; in the order of the variant.
struct LightType {
    std::string_view name;
    LightSpec (*read)(JsonReader&);
};
constexpr LightType k_light_types[] = {
    {"emissive_mtl", read_emissive_mtl},
    {"quad", read_quad},
    {"sphere", read_sphere},
    {"point", read_point},
    {"sun", read_sun},
    {"sky", read_sky},
    {"envmap", read_envmap},
};
static_assert(std::size(k_light_types) == std::variant_size_v<LightSpec>);

LightSpec read_light(JsonReader value) {
    const JsonReader type = value.need("type");
    const std::string name = type.text();
    for (const LightType& known : k_light_types) {
        if (known.name != name) continue;
        LightSpec light = known.read(value);
        value.refuse_unknown_keys();
        return light;
    }
    std::string known;
    for (const LightType& light : k_light_types)
        known += fmt::format("{}{}", known.empty() ? "" : ", ", light.name);
    type.fail(fmt::format("unknown type \"{}\"; known are {}.", name, known));
    return {};
}

std::vector<LightSpec> read_lights(const JsonReader& value) {
    std::vector<LightSpec> lights;
    for (const JsonReader& element : value.elements()) lights.push_back(read_light(element));
    if (lights.empty()) value.fail("no light, no image; name one, or leave the key out to have one chosen.");
    return lights;
}

MaterialKind read_material_kind(const JsonReader& value) {
    const auto kind = from_name<MaterialKind>(value.text());
    if (!kind) value.fail(fmt::format("must be one of {}.", joined_names<MaterialKind>(", ")));
    return kind.value_or(MaterialKind::standard);
}

MaterialOverride read_override(JsonReader value) {
    MaterialOverride result;
    if (auto v = value.find("model")) result.model = read_material_kind(*v);
    if (auto v = value.find("kd")) result.kd = v->colour(1);
    if (auto v = value.find("ks")) result.ks = v->colour(1);
    if (auto v = value.find("ke")) result.ke = v->colour();
    if (auto v = value.find("roughness")) result.roughness = v->number_in(0, 1);
    if (auto v = value.find("metallic")) result.metallic = v->number_in(0, 1);
    if (auto v = value.find("ior")) result.ior = v->number_in(1, 10);
    if (auto v = value.find("opacity")) result.opacity = v->number_in(0, 1);
    if (auto v = value.find("map_kd")) result.map_kd = v->text();
    if (auto v = value.find("map_ks")) result.map_ks = v->text();
    if (auto v = value.find("map_ke")) result.map_ke = v->text();
    if (auto v = value.find("map_d")) result.map_d = v->text();
    if (auto v = value.find("map_roughness")) result.map_roughness = v->text();
    value.refuse_unknown_keys();
    return result;
}

RenderDefaults read_defaults(JsonReader value) {
    RenderDefaults defaults;
    if (auto size = value.find("size")) {
        const auto sides = size->elements();
        if (sides.size() == 2)
            defaults.size = {sides[0].integer_in(1, k_max_side), sides[1].integer_in(1, k_max_side)};
        else
            size->fail("must be a list of width and height.");
    }
    if (auto spp = value.find("spp")) defaults.spp = spp->integer_in(1, k_max_spp);
    if (auto bounces = value.find("bounces")) defaults.bounces = bounces->integer_in(0, k_max_bounces);
    value.refuse_unknown_keys();
    return defaults;
}

PreviewSpec read_preview(JsonReader value) {
    PreviewSpec preview;
    if (auto v = value.find("renderer")) preview.renderer = v->text();
    if (auto v = value.find("view_transform")) preview.view_transform = v->text();
    if (auto v = value.find("exposure_ev")) preview.exposure_ev = v->number();
    value.refuse_unknown_keys();
    return preview;
}

SceneFile read_scene(JsonReader root) {
    SceneFile scene;
    if (auto v = root.find("name")) scene.name = v->text();
    scene.objs = read_objs(root.need("obj"));
    if (auto v = root.find("up_axis")) scene.up_axis = read_up_axis(*v);
    if (auto v = root.find("units_to_metres")) scene.units_to_metres = v->positive_number();
    scene.cameras = read_cameras(root, scene.up_axis);
    if (auto v = root.find("variants")) scene.variants = read_variants(*v, scene);
    if (auto v = root.find("lights")) scene.lights = read_lights(*v);
    if (auto v = root.find("materials"))
        for (const auto& [name, material] : v->entries()) scene.materials[name] = read_override(material);
    if (auto v = root.find("defaults")) scene.defaults = read_defaults(*v);
    if (auto v = root.find("exposure_ev")) scene.exposure_ev = v->number();
    if (auto v = root.find("preview")) scene.preview = read_preview(*v);
    root.refuse_unknown_keys();
    return scene;
}

// ---- To JSON -------------------------------------------------------------------------------------------------

/// The shortest decimals that come back as the same float: 0.1f is written 0.1, not 0.10000000149011612.
/// They are read as a double first, which for very few floats ends beside them; those are written in full.
double shortest(float value) {
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof digits, value);
    double wide = 0;
    std::from_chars(digits, end.ptr, wide);
    return static_cast<float>(wide) == value ? wide : static_cast<double>(value);
}

json written(Vec3 v) { return {shortest(v.x), shortest(v.y), shortest(v.z)}; }

json written(const CameraSpec& camera) {
    json out{{"name", camera.name},
             {"position", written(camera.view.position)},
             {"look_at", written(camera.view.look_at)},
             {"up", written(camera.view.up)},
             {"vfov_deg", shortest(camera.view.vfov_deg)}};
    if (camera.aspect) out["aspect"] = fmt::format("{}:{}", camera.aspect->width, camera.aspect->height);
    return out;
}

json written(const EmissiveMtlSpec& light) { return {{"two_sided", light.two_sided}}; }
json written(const QuadLightSpec& light) {
    return {{"corner", written(light.corner)},
            {"edge_u", written(light.edge_u)},
            {"edge_v", written(light.edge_v)},
            {"radiance", written(light.radiance)}};
}
json written(const SphereLightSpec& light) {
    return {{"centre", written(light.centre)},
            {"radius", shortest(light.radius)},
            {"radiance", written(light.radiance)}};
}
json written(const PointLightSpec& light) {
    return {{"position", written(light.position)}, {"intensity", written(light.intensity)}};
}
json written(const SunSpec& light) {
    return {{"to_sun", written(light.to_sun)},
            {"irradiance", written(light.irradiance)},
            {"angle_deg", shortest(light.angle_deg)}};
}
json written(const SkySpec& light) { return {{"radiance", written(light.radiance)}}; }
json written(const EnvmapSpec& light) {
    return {{"file", light.file}, {"scale", shortest(light.scale)}, {"rotate_y", shortest(light.rotate_y)}};
}
json written(const LightSpec& light) {
    json out = std::visit([](const auto& spec) { return written(spec); }, light);
    out["type"] = k_light_types[light.index()].name;
    return out;
}

json written(const MaterialOverride& material) {
    json out = json::object();
    if (material.model) out["model"] = name_of(*material.model);
    if (material.kd) out["kd"] = written(*material.kd);
    if (material.ks) out["ks"] = written(*material.ks);
    if (material.ke) out["ke"] = written(*material.ke);
    if (material.roughness) out["roughness"] = shortest(*material.roughness);
    if (material.metallic) out["metallic"] = shortest(*material.metallic);
    if (material.ior) out["ior"] = shortest(*material.ior);
    if (material.opacity) out["opacity"] = shortest(*material.opacity);
    if (material.map_kd) out["map_kd"] = *material.map_kd;
    if (material.map_ks) out["map_ks"] = *material.map_ks;
    if (material.map_ke) out["map_ke"] = *material.map_ke;
    if (material.map_d) out["map_d"] = *material.map_d;
    if (material.map_roughness) out["map_roughness"] = *material.map_roughness;
    return out;
}

json written(const RenderDefaults& defaults) {
    json out = json::object();
    if (defaults.size) out["size"] = {defaults.size->width, defaults.size->height};
    if (defaults.spp) out["spp"] = *defaults.spp;
    if (defaults.bounces) out["bounces"] = *defaults.bounces;
    return out;
}

json written(const PreviewSpec& preview) {
    return {{"renderer", preview.renderer},
            {"view_transform", preview.view_transform},
            {"exposure_ev", shortest(preview.exposure_ev)}};
}

}  // namespace

Result<SceneFile> parse_scene_file(std::string_view text, const std::string& shown_path) {
    JsonProblem problem{shown_path, std::nullopt};
    const json value = parse_json(text, problem);
    if (problem.first) return *problem.first;
    SceneFile scene = read_scene(JsonReader(value, "", problem));
    if (problem.first) return *problem.first;
    return scene;
}

std::string to_json(const SceneFile& scene) {
    json out{{"name", scene.name},
             {"obj", scene.objs},
             {"up_axis", scene.up_axis == UpAxis::y ? "Y" : "Z"},
             {"units_to_metres", shortest(scene.units_to_metres)},
             {"exposure_ev", shortest(scene.exposure_ev)}};
    for (const CameraSpec& camera : scene.cameras) out["cameras"].push_back(written(camera));
    for (const LightSpec& light : scene.lights) out["lights"].push_back(written(light));
    for (const auto& [obj, camera] : scene.variants) out["variants"][obj] = camera;
    for (const auto& [name, material] : scene.materials) out["materials"][name] = written(material);
    if (scene.defaults != RenderDefaults{}) out["defaults"] = written(scene.defaults);
    if (scene.preview) out["preview"] = written(*scene.preview);
    return out.dump(-1, ' ', false, json::error_handler_t::replace);
}

const CameraSpec* find_camera(const SceneFile& scene, std::string_view name) {
    for (const CameraSpec& camera : scene.cameras)
        if (camera.name == name) return &camera;
    return nullptr;
}

}  // namespace pathscope
