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

struct ShadedPoint {
    Bsdf bsdf;
    Frame frame;            ///< World to local: z is the shading normal.
    Vec3 geometric_normal;  ///< On the side of the frame's z.
};

/// Requires: outgoing of length one.
[[nodiscard]] ShadedPoint shade_point(const Scene& scene, const SceneHit& hit, Vec3 outgoing);

/// The BSDF alone, textures looked up.
[[nodiscard]] Bsdf make_bsdf(const Scene& scene, const SceneHit& hit);

/// Whether both normals agree on which side `incoming` is. Directions in the surface itself are on neither.
[[nodiscard]] inline bool is_consistent(const ShadedPoint& point, Vec3 incoming) {
    return dot(incoming, point.geometric_normal) * dot(incoming, point.frame.normal) > 0;
}

/// The shading normal, bent if need be. `geometric` must be on its side: dot(shading, geometric) >= 0.
/// Ensures: dot(result, outgoing) has the sign of dot(geometric, outgoing); result of length one.
[[nodiscard]] Vec3 bend_normal(Vec3 shading, Vec3 geometric, Vec3 outgoing);

/// Colour of the surface for filter guides and the albedo buffer.
[[nodiscard]] Rgb surface_albedo(const Scene& scene, const SceneHit& hit, Vec3 outgoing);

}  // namespace pathscope
