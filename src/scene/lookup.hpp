#pragma once
/// Material values at a point: the plain value, times or in place of what its map says there.

#include "pathscope/scene/scene.hpp"

namespace pathscope {

[[nodiscard]] inline Rgb colour_at(const Scene& scene, Rgb value, const TextureUse& map, Vec2 uv) {
    return map ? value * scene.textures[std::size_t(map.index)].eval(map.at(uv)) : value;
}

[[nodiscard]] inline float grey_at(const Scene& scene, const TextureUse& map, Vec2 uv) {
    return scene.textures[std::size_t(map.index)].eval_grey(map.at(uv));
}

[[nodiscard]] inline bool is_solid_at(const Scene& scene, const Material& material, Vec2 uv) {
    return !material.map_d || grey_at(scene, material.map_d, uv) >= k_cutout_threshold;
}

[[nodiscard]] inline bool emits_towards(const Material& material, Vec3 geometric_normal, Vec3 direction) {
    return material.two_sided_emission || dot(geometric_normal, direction) > 0;
}

/// Radiance that the point of a surface sends towards `outgoing`; of a hole nothing.
[[nodiscard]] inline Rgb emission_at(const Scene& scene, const SurfacePoint& point, Vec3 outgoing) {
    const Material& material = scene.materials[point.material];
    if (!material.emits() || !emits_towards(material, point.geometric_normal, outgoing)) return {};
    if (!is_solid_at(scene, material, point.uv)) return {};
    return colour_at(scene, material.ke, material.map_ke, point.uv);
}

}  // namespace pathscope
