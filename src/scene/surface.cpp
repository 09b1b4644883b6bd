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

Vec3 bend_normal(Vec3 shading, Vec3 geometric, Vec3 outgoing) {
    // On the viewer's side of the triangle; turned back at the end.
    const float side = dot(geometric, outgoing) >= 0 ? 1.0f : -1.0f;
    const Vec3 n = shading * side, surface = geometric * side;
    const Vec3 mirrored = reflect(outgoing, n);

    // How far above the triangle the mirror direction must stay. On a flat triangle it is as far above as
    // `outgoing`, and is never bent.
    const float height = dot(outgoing, surface);
    const float least = std::min(0.01f, 0.5f * height);
    const float below = least - dot(mirrored, surface);
    if (below <= 0) return shading;
    const Vec3 raised = normalize(mirrored + surface * below);
    const Vec3 between = outgoing + raised;
    return is_zero(between) ? geometric : normalize(between) * side;
}

ShadedPoint shade_point(const Scene& scene, const SceneHit& hit, Vec3 outgoing) {
    ShadedPoint point{make_bsdf(scene, hit), {}, hit.point.geometric_normal};
    Vec3 normal = bend_normal(hit.point.shading_normal, point.geometric_normal, outgoing);
    if (!has_inside(point.bsdf) && dot(point.geometric_normal, outgoing) < 0) {
        normal = -normal;
        point.geometric_normal = -point.geometric_normal;
    }
    point.frame = Frame::around(normal);
    return point;
}

Rgb surface_albedo(const Scene& scene, const SceneHit& hit, Vec3 outgoing) {
    const ShadedPoint point = shade_point(scene, hit, outgoing);
    return guide_albedo(point.bsdf, point.frame.to_local(outgoing));
}

}  // namespace pathscope
