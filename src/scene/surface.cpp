#include "pathscope/scene/surface.hpp"

#include "lookup.hpp"

namespace pathscope {
namespace {

Surface make_surface(const Scene& scene, const Material& material, Vec2 uv) {
    switch (material.kind) {
        case MaterialKind::lambert:
            return Lambert{colour_at(scene, material.kd, material.map_kd, uv)};
        case MaterialKind::standard:
            return StandardSurface{
                colour_at(scene, material.kd, material.map_kd, uv),
                colour_at(scene, material.ks, material.map_ks, uv),
                material.map_roughness ? grey_at(scene, material.map_roughness, uv) : material.roughness};
        case MaterialKind::mirror:
            return Mirror{colour_at(scene, material.ks, material.map_ks, uv)};
        case MaterialKind::dielectric:
            return Dielectric{material.ior, {1, 1, 1}};
        case MaterialKind::thin_glass:
            return ThinGlass{material.ior, {1, 1, 1}};
    }
    return Lambert{};
}

}  // namespace

Bsdf make_bsdf(const Scene& scene, const SceneHit& hit) {
    const Material& material = scene.materials[hit.point.material];
    return {make_surface(scene, material, hit.point.uv), material.opacity};
}

Rgb surface_albedo(const Scene& scene, const SceneHit& hit, Vec3 outgoing) {
    const ShadedPoint point = shade_point(scene, hit, outgoing);
    return guide_albedo(point.bsdf, point.frame.to_local(outgoing));
}

}  // namespace pathscope
