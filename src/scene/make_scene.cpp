#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "lookup.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/sampling/warp.hpp"
#include "pathscope/scene/scene.hpp"

namespace pathscope {
namespace {

/// Squares of distances and areas must stay finite in floats.
constexpr float k_largest_coordinate = 1e15f;
/// So must the light of many bounces and samples.
constexpr float k_brightest = 1e30f;

// ---- Surfaces of the scene file's lights.

std::uint32_t add_black_emitter(Scene& scene, const char* name, Rgb radiance) {
    Material material;
    material.name = name;
    material.kind = MaterialKind::lambert;
    material.ke = radiance;
    material.two_sided_emission = false;
    scene.materials.push_back(std::move(material));
    return std::uint32_t(scene.materials.size() - 1);
}

/// The corners in the order that makes edge_u x edge_v the front.
void add_quad(Scene& scene, const QuadLightSpec& quad) {
    Mesh& mesh = scene.mesh;
    const auto first = std::uint32_t(mesh.positions.size());
    for (const Vec2 uv : {Vec2{0, 0}, Vec2{1, 0}, Vec2{1, 1}, Vec2{0, 1}}) {
        mesh.positions.push_back(quad.corner + quad.edge_u * uv.x + quad.edge_v * uv.y);
        if (!mesh.normals.empty()) mesh.normals.push_back({});
        if (!mesh.uvs.empty()) mesh.uvs.push_back(uv);
    }
    const std::uint32_t material = add_black_emitter(scene, "quad light", quad.radiance);
    mesh.materials.resize(mesh.triangles.size(), 0);  // An empty list means 0 for all.
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
    mesh.materials.insert(mesh.materials.end(), 2, material);
}

void add_sphere(Scene& scene, const SphereLightSpec& light) {
    const std::uint32_t material = add_black_emitter(scene, "sphere light", light.radiance);
    scene.spheres.push_back({light.centre, light.radius, material});
}

/// Ke counts if the file says so, or says nothing about light at all.
void switch_emission(std::vector<Material>& materials, const std::vector<LightSpec>& lights) {
    const EmissiveMtlSpec* emissive = nullptr;
    for (const LightSpec& light : lights)
        if (const auto* found = std::get_if<EmissiveMtlSpec>(&light)) emissive = found;
    for (Material& material : materials) {
        if (emissive) material.two_sided_emission = emissive->two_sided;
        if (!emissive && !lights.empty()) material.ke = {};
    }
}

Result<void> check_size(const Scene& scene) {
    if (scene.bounds.empty()) return {};
    const float farthest = max_component(max(abs(scene.bounds.low), abs(scene.bounds.high)));
    if (farthest <= k_largest_coordinate) return {};
    return bad_input(
        fmt::format("The scene reaches {:.3g} units from its origin, and {:.3g} is the most that light "
                    "can be computed in; scale it down.",
                    farthest, k_largest_coordinate));
}

void add_records(Scene& scene) {
    for (std::uint32_t triangle = 0; triangle < scene.mesh.triangle_count(); ++triangle) {
        scene.records.push_back(make_triangle_record(scene.mesh, triangle));
        if (!scene.materials[scene.records.back().material].map_d) continue;
        scene.cutouts.resize((scene.mesh.triangle_count() + 63) / 64);
        scene.cutouts[triangle / 64] |= std::uint64_t{1} << triangle % 64;
    }
}

// ---- The table of lights.

/// Mean emission of a triangle for its power: over 16 points, or as it is without maps. At least a hundredth
/// of what its material can emit, so that a bright spot between the points is found too.
Rgb mean_radiance(const Scene& scene, std::uint32_t triangle) {
    const Material& material = scene.materials[scene.mesh.material_of(triangle)];
    if (!material.map_ke && !material.map_d) return material.ke;
    constexpr int k_side = 4;
    Rgb sum;
    for (int i = 0; i < k_side * k_side; ++i) {
        const Vec2 u{(float(i % k_side) + 0.5f) / k_side, (float(i / k_side) + 0.5f) / k_side};
        const Vec2 b = sample_triangle(u);
        const SurfacePoint point = surface_point(scene.mesh, {0, b.x, b.y, triangle});
        sum += emission_at(scene, point, point.geometric_normal);
    }
    return max(sum / (k_side * k_side), material.ke * 0.01f);
}

/// A triangle's corners in an order of their own, so that copies of it are equal.
using CornerSet = std::array<Corner, 3>;
CornerSet corner_set(const TriangleCorners& triangle) {
    CornerSet set{as_corner(triangle.a), as_corner(triangle.b), as_corner(triangle.c)};
    std::sort(set.begin(), set.end());
    return set;
}

std::optional<TriangleLight> quad_with_last(const LightTable& table, const TriangleLight& light) {
    if (table.lights.empty()) return std::nullopt;
    const TriangleLight& last = std::get<TriangleLight>(table.lights.back());
    if (last.is_quad() || last.triangle + 1 != light.triangle) return std::nullopt;
    return make_quad_light(last, light);
}

/// Of emitters that coincide rays meet the first only, so only that one is a light. A triangle that makes a quad with the one
/// before it joins that one's light: so files and loaders cut quads.
void add_triangle_lights(Scene& scene) {
    LightTable& table = scene.lights;
    std::set<CornerSet> seen;
    for (std::uint32_t triangle = 0; triangle < scene.mesh.triangle_count(); ++triangle) {
        const Material& material = scene.materials[scene.mesh.material_of(triangle)];
        if (!material.emits()) continue;
        if (table.of_triangle.empty()) table.of_triangle.assign(scene.mesh.triangle_count(), k_no_light);
        const TriangleCorners where = corners(scene.mesh, triangle);
        if (!(area(where) > 0) || !seen.insert(corner_set(where)).second) continue;
        const TriangleLight light =
            make_triangle_light(scene.mesh, triangle, material, mean_radiance(scene, triangle));
        if (const auto quad = quad_with_last(table, light)) {
            table.lights.back() = *quad;
        } else {
            table.lights.push_back(light);
        }
        table.of_triangle[triangle] = std::uint32_t(table.lights.size() - 1);
    }
}

void add_sphere_lights(Scene& scene) {
    for (std::uint32_t i = 0; i < scene.spheres.size(); ++i) {
        const Material& material = scene.materials[scene.spheres[i].material];
        scene.lights.of_sphere.push_back(material.emits() ? std::uint32_t(scene.lights.lights.size())
                                                          : k_no_light);
        if (material.emits())
            scene.lights.lights.push_back(SphereLight{i, scene.spheres[i].radius, material.ke});
    }
}

/// The lights without surface, and the emission of materials, which is added elsewhere.
struct AddLight {
    const SceneFile& file;
    const SceneParts& parts;
    LightTable& table;

    Result<void> operator()(const EmissiveMtlSpec&) { return {}; }
    Result<void> operator()(const QuadLightSpec&) { return {}; }
    Result<void> operator()(const SphereLightSpec&) { return {}; }
    Result<void> operator()(const PointLightSpec& spec) {
        if (!is_zero(spec.intensity)) table.lights.push_back(PointLight{spec.position, spec.intensity});
        return {};
    }
    Result<void> operator()(const SunSpec& spec) {
        if (!is_zero(spec.irradiance))
            table.lights.push_back(make_sun_light(spec.to_sun, spec.irradiance, spec.angle_deg));
        return {};
    }
    Result<void> operator()(const SkySpec& spec) {
        if (!is_zero(spec.radiance)) table.lights.push_back(SkyLight{spec.radiance});
        return {};
    }
    Result<void> operator()(const EnvmapSpec& spec) {
        CHECK(parts.envmap, spec.file);
        auto map = make_environment_map(spec.file, *parts.envmap, spec.scale, spec.rotate_y, file.up_axis);
        if (!map) return map.error();
        table.lights.push_back(EnvironmentLight{std::uint32_t(table.environments.size())});
        table.environments.push_back(*std::move(map));
        return {};
    }
};

// ---- Where the lights are.

std::optional<LightBounds> bounds_of(const Scene&, const TriangleLight& light) {
    LightBounds bounds;
    bounds.box = pathscope::bounds(light.corners[0]);
    if (light.is_quad()) bounds.box.add(pathscope::bounds(light.corners[1]));
    bounds.normal = light.normal;
    bounds.side = light.two_sided ? ShinesTo::both_sides : ShinesTo::front;
    bounds.intensity = double(luminance(light.mean_radiance)) * light.area;
    return bounds;
}
std::optional<LightBounds> bounds_of(const Scene& scene, const SphereLight& light) {
    const Vec3 half{light.radius, light.radius, light.radius};
    const Vec3 centre = scene.spheres[light.sphere].centre;
    LightBounds bounds;
    bounds.box = {centre - half, centre + half};
    bounds.intensity = light_area(light) / 4 * luminance(light.radiance);  // As a disc.
    return bounds;
}
std::optional<LightBounds> bounds_of(const Scene&, const PointLight& light) {
    LightBounds bounds;
    bounds.box = {light.position, light.position};
    bounds.intensity = luminance(light.intensity);
    return bounds;
}
template <class LightAtInfinity>
std::optional<LightBounds> bounds_of(const Scene&, const LightAtInfinity&) {
    return std::nullopt;
}

std::vector<std::optional<LightBounds>> light_bounds(const Scene& scene) {
    std::vector<std::optional<LightBounds>> bounds;
    for (const Light& light : scene.lights.lights)
        bounds.push_back(std::visit([&](const auto& kind) { return bounds_of(scene, kind); }, light));
    return bounds;
}

// ---- How bright it is.

struct Brightness {
    Rgb typical, brightest;
};

Brightness brightness_of(const Scene&, const TriangleLight& light) { return {light.mean_radiance, {}}; }
Brightness brightness_of(const Scene&, const SphereLight& light) { return {light.radiance, {}}; }
Brightness brightness_of(const Scene& scene, const PointLight& light) {
    const float radius = scene_radius(scene);
    return {light.intensity / (radius * radius), {}};
}
Brightness brightness_of(const Scene&, const SunLight& light) {
    return {light.irradiance * k_inv_pi, light.radiance};
}
Brightness brightness_of(const Scene&, const SkyLight& light) { return {light.radiance, light.radiance}; }
Brightness brightness_of(const Scene& scene, const EnvironmentLight& light) {
    const EnvironmentMap& map = scene.lights.environments[light.map];
    Rgb brightest;
    for (const Rgb& texel : map.radiance.pixels) brightest = max(brightest, texel);
    return {map.mean_radiance, brightest};
}

/// Lights from infinity shine through each other, so their brightest directions might add up.
void measure_brightness(Scene& scene) {
    Rgb typical, surfaces, infinity;
    for (const Light& light : scene.lights.lights) {
        const Brightness of_light =
            std::visit([&](const auto& kind) { return brightness_of(scene, kind); }, light);
        typical = max(typical, of_light.typical);
        infinity += of_light.brightest;
    }
    for (const Material& material : scene.materials) surfaces = max(surfaces, material.ke);
    scene.typical_radiance = max_component(typical);
    scene.brightest_radiance = max_component(max(typical, max(surfaces, infinity)));
}

/// A sun of next to no width may be brighter than any float, whatever its irradiance.
Result<void> check_brightness(const Scene& scene) {
    if (scene.typical_radiance <= k_brightest && scene.brightest_radiance <= k_brightest) return {};
    return bad_input(
        "The lights of the scene are brighter than light can be computed in; make them darker, or the sun "
        "wider.");
}

}  // namespace

Result<Scene> make_scene(const SceneFile& file, SceneParts parts, const SceneBuild& build) {
    Scene scene;
    scene.mesh = std::move(parts.mesh);
    scene.materials = std::move(parts.materials);
    scene.textures = std::move(parts.textures);

    switch_emission(scene.materials, file.lights);
    for (const LightSpec& light : file.lights) {
        if (const auto* quad = std::get_if<QuadLightSpec>(&light)) add_quad(scene, *quad);
        if (const auto* sphere = std::get_if<SphereLightSpec>(&light)) add_sphere(scene, *sphere);
    }
    add_records(scene);

    scene.mesh.longest_side = longest_side(scene.mesh);
    scene.bounds = bounds(scene.mesh);
    for (const Sphere& sphere : scene.spheres) {
        const Vec3 half{sphere.radius, sphere.radius, sphere.radius};
        scene.bounds.add(Box{sphere.centre - half, sphere.centre + half});
    }
    if (auto fits = check_size(scene); !fits) return fits.error();
    scene.tree = build_tree(scene.mesh, build.tree, build.threads);

    add_triangle_lights(scene);
    add_sphere_lights(scene);
    for (const LightSpec& light : file.lights)
        if (auto added = std::visit(AddLight{file, parts, scene.lights}, light); !added) return added.error();
    measure_brightness(scene);
    if (auto fits = check_brightness(scene); !fits) return fits.error();
    finish_light_table(scene.lights, scene_radius(scene), light_bounds(scene));
    if (scene.lights.empty()) log_warning("The scene has no light: the image will be black.");
    return scene;
}

}  // namespace pathscope
