#pragma once
/// Closed rooms for tests of the whole estimator.

#include "pathscope/integrator/path_estimator.hpp"
#include "scene/small_scenes.hpp"

namespace pathscope::testing {

inline Material lambert(Rgb kd, Rgb ke = {}) {
    Material material;
    material.kind = MaterialKind::lambert;
    material.kd = kd;
    material.ke = ke;
    return material;
}

/// All six sides of the box [low, high].
inline void add_box(SceneParts& parts, Vec3 low, Vec3 high, std::uint32_t material) {
    const Vec3 x{high.x - low.x, 0, 0}, y{0, high.y - low.y, 0}, z{0, 0, high.z - low.z};
    add_rectangle(parts, low, y, x, material);
    add_rectangle(parts, low + z, x, y, material);
    add_rectangle(parts, low, z, y, material);
    add_rectangle(parts, low + x, y, z, material);
    add_rectangle(parts, low, x, z, material);
    add_rectangle(parts, low + y, z, x, material);
}

/// A closed box of which every wall emits le and reflects rho: the radiance is le / (1 - rho) everywhere.
inline Scene furnace(float le, float rho) {
    SceneParts parts = empty_parts();
    add_box(parts, {-1, -1, -1}, {1, 1, 1}, add_material(parts, lambert({rho, rho, rho}, {le, le, le})));
    return small_scene(std::move(parts), {EmissiveMtlSpec{}});
}

/// A room with a glossy block, a mirror, a body of glass, a half-transparent pane, and a light below the ceiling.
/// The light shines downwards only: upwards it would be near the ceiling, where 1/r^2 of the textbook's area sampling
/// makes a variance that no z-test survives.
inline Scene small_room() {
    SceneParts parts = empty_parts();
    add_box(parts, {-1, -1, -1}, {1, 1, 1}, add_material(parts, lambert({0.7f, 0.6f, 0.5f})));
    Material glossy;
    glossy.kd = {0.2f, 0.3f, 0.1f};
    glossy.ks = {0.3f, 0.3f, 0.3f};
    glossy.roughness = 0.5f;
    add_box(parts, {-0.6f, -0.99f, -0.5f}, {0.0f, -0.2f, 0.1f}, add_material(parts, glossy));
    Material mirror;
    mirror.kind = MaterialKind::mirror;
    mirror.ks = {0.9f, 0.9f, 0.9f};
    add_rectangle(parts, {0.98f, -0.5f, -0.5f}, {0, 0, 1}, {0, 1, 0}, add_material(parts, mirror));
    Material glass;
    glass.kind = MaterialKind::dielectric;
    add_box(parts, {0.2f, -0.9f, 0.1f}, {0.6f, -0.4f, 0.5f}, add_material(parts, glass));
    Material veil = lambert({0.8f, 0.2f, 0.2f});
    veil.opacity = 0.5f;
    add_rectangle(parts, {-0.9f, -0.4f, 0.3f}, {0.6f, 0, 0}, {0, 0.6f, 0}, add_material(parts, veil));
    add_rectangle(parts, {-0.4f, 0.98f, -0.4f}, {0.8f, 0, 0}, {0, 0, 0.8f},
                  add_material(parts, lambert({0.5f, 0.5f, 0.5f}, {6, 5, 4})));
    return small_scene(std::move(parts), {EmissiveMtlSpec{false}});
}

/// The same kind of room with a glossy floor and 24 small lamps, half of which shine at the ceiling; those behind a wall
/// are brighter. There is a sky as well, which the walls shut out.
inline Scene room_of_lamps() {
    SceneParts parts = empty_parts();
    add_box(parts, {-1, -1, -1}, {1, 1, 1}, add_material(parts, lambert({0.5f, 0.6f, 0.5f})));
    Material glossy;
    glossy.kd = {0.2f, 0.3f, 0.1f};
    glossy.ks = {0.3f, 0.3f, 0.3f};
    glossy.roughness = 0.4f;
    add_box(parts, {-0.6f, -0.99f, -0.8f}, {0.6f, -0.8f, 0.1f}, add_material(parts, glossy));
    add_rectangle(parts, {0.3f, -1, -0.4f}, {0, 0, 0.8f}, {0, 2, 0},
                  add_material(parts, lambert({0.4f, 0.4f, 0.4f})));
    std::vector<LightSpec> lights{SkySpec{{1, 1, 1}},
                                  SphereLightSpec{{-0.5f, 0.3f, -0.5f}, 0.05f, {20, 20, 20}}};
    for (int i = 0; i < 24; ++i) {
        const float x = -0.9f + 0.15f * float(i % 12), z = i < 12 ? -0.7f : 0.5f,
                    radiance = x > 0.4f ? 300.0f : 10.0f;
        const Vec3 u{0.04f, 0, 0}, v{0, 0, 0.05f};  // u x v points down.
        lights.push_back(
            QuadLightSpec{{x, 0.8f, z}, i % 2 ? u : v, i % 2 ? v : u, {radiance, radiance, radiance}});
    }
    return small_scene(std::move(parts), std::move(lights));
}

/// A ray of a small square picture of the room.
inline CameraFrame room_camera(int size) {
    return make_camera({{0, 0, 0.95f}, {0, -0.1f, 0}, {0, 1, 0}, 80}, size, size);
}

inline Ray room_ray(int x, int y, int size, const PixelSampler& sampler) {
    return camera_ray(room_camera(size), x, y, sampler.get_2d(k_pixel_dimension));
}

}  // namespace pathscope::testing
