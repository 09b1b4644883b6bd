#pragma once
/// Scenes of a few triangles, made by hand, whose light can be worked out on paper.

#include <string>
#include <utility>
#include <vector>

#include "pathscope/core/check.hpp"
#include "pathscope/core/log.hpp"
#include "pathscope/scene/scene.hpp"

namespace pathscope::testing {

/// Material 0 of every small scene: it reflects a little and emits nothing.
inline Material grey() {
    Material material;
    material.name = "grey";
    material.kind = MaterialKind::lambert;
    material.kd = {0.5f, 0.5f, 0.5f};
    return material;
}

inline SceneParts empty_parts() {
    SceneParts parts;
    parts.materials.push_back(grey());
    return parts;
}

inline std::uint32_t add_material(SceneParts& parts, Material material) {
    parts.materials.push_back(std::move(material));
    return std::uint32_t(parts.materials.size() - 1);
}

/// Two triangles, corner + a edge_u + b edge_v, with texture coordinates (a, b); the front is that of
/// edge_u x edge_v.
inline void add_rectangle(SceneParts& parts, Vec3 corner, Vec3 edge_u, Vec3 edge_v,
                          std::uint32_t material = 0) {
    Mesh& mesh = parts.mesh;
    const auto first = mesh.positions.size();
    for (const Vec2 uv : {Vec2{0, 0}, Vec2{1, 0}, Vec2{1, 1}, Vec2{0, 1}}) {
        mesh.positions.push_back(corner + edge_u * uv.x + edge_v * uv.y);
        mesh.uvs.push_back(uv);
    }
    const auto index = std::uint32_t(first);
    mesh.triangles.push_back({index, index + 1, index + 2});
    mesh.triangles.push_back({index, index + 2, index + 3});
    mesh.materials.insert(mesh.materials.end(), 2, material);
}

inline Scene small_scene(SceneParts parts, std::vector<LightSpec> lights = {}) {
    SceneFile file;
    file.name = "small";
    file.lights = std::move(lights);
    auto scene = make_scene(file, std::move(parts), {.threads = 1});
    CHECK(scene, scene.error().message);
    return *std::move(scene);
}
inline Scene small_scene(std::vector<LightSpec> lights) {
    return small_scene(empty_parts(), std::move(lights));
}

}  // namespace pathscope::testing
