#pragma once
/// A hit made ready for shading: its BSDF with the textures looked up, and the frame to evaluate it in.
///
/// Surfaces are seen from both sides: the frame is turned so that `outgoing` is above it. Only a body of
/// glass has an inside; its frame keeps pointing outwards (shading/bsdf.hpp).
///
/// Interpolated normals lie: they pretend a curve that the triangles do not follow. Three rules keep the lie
/// from showing:
/// - Light does not leak through. `incoming` must lie on that side of the triangle on which the shading frame
///   has it; else is_consistent() is false and the direction carries nothing.
/// - No black rims. Where the mirror direction of `outgoing` about the normal would dip below the triangle,
///   the normal is bent back just so far that it does not. So `outgoing` is above both planes or below both.
/// - Rays start off the triangle itself (geometry/spawn.hpp).
/// Thread safety: pure.   Test: tests/scene/test_surface.cpp

#include "pathscope/math/frame.hpp"
#include "pathscope/scene/scene.hpp"
#include "pathscope/shading/bsdf.hpp"

namespace pathscope {

/// The side of a surface that is seen.
struct SurfaceSide {
    Frame frame;            ///< World to local: z is the shading normal.
    Vec3 geometric_normal;  ///< On the side of the frame's z.
};

struct ShadedPoint : SurfaceSide {
    Bsdf bsdf;
};

/// The BSDF alone, textures looked up.
[[nodiscard]] Bsdf make_bsdf(const Scene& scene, const SceneHit& hit);

/// Whether both normals agree on which side `incoming` is. Directions in the surface itself are on neither.
[[nodiscard]] inline bool is_consistent(const SurfaceSide& side, Vec3 incoming) {
    return dot(incoming, side.geometric_normal) * dot(incoming, side.frame.normal) > 0;
}

/// The shading normal, bent if need be. `geometric` must be on its side: dot(shading, geometric) >= 0.
/// Ensures: dot(result, outgoing) has the sign of dot(geometric, outgoing); result of length one.
[[nodiscard]] inline Vec3 bend_normal(Vec3 shading, Vec3 geometric, Vec3 outgoing) {
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

/// Requires: outgoing of length one.
[[nodiscard]] inline SurfaceSide see_side(const Scene& scene, const SceneHit& hit, Vec3 outgoing) {
    Vec3 geometric = hit.point.geometric_normal;
    Vec3 normal = bend_normal(hit.point.shading_normal, geometric, outgoing);
    const bool has_inside = scene.materials[hit.point.material].kind == MaterialKind::dielectric;
    if (!has_inside && dot(geometric, outgoing) < 0) {
        normal = -normal;
        geometric = -geometric;
    }
    return {Frame::around(normal), geometric};
}
[[nodiscard]] inline ShadedPoint shade_point(const Scene& scene, const SceneHit& hit, Vec3 outgoing) {
    return {see_side(scene, hit, outgoing), make_bsdf(scene, hit)};
}

/// Colour of the surface for filter guides and the albedo buffer.
[[nodiscard]] Rgb surface_albedo(const Scene& scene, const SceneHit& hit, Vec3 outgoing);

}  // namespace pathscope
