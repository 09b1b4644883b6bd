#pragma once
/// Where a ray meets a sphere; spheres are lights here.
///
///     |o + t d - c|^2 = r^2,   f = o - c,   a = d.d,   b = -f.d,   q = b + sign(b) sqrt(a D)
///     D = r^2 - |f + (b/a) d|^2      t = (f.f - r^2) / q,  q / a
///
/// Why not the formula from school: b^2 - a c loses all digits when the sphere is small and far away, while
/// f + (b/a) d is the vector from the centre to the ray, whose length is of the size of r. And
/// -b + sqrt(..) loses them when the origin is near the sphere; q never subtracts. In double, relative, no epsilon.
///
/// Requires: radius > 0. Thread safety: pure.
/// Source: Haines, Günther, Akenine-Möller 2019, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing
/// Gems, chapter 7.   Test: tests/geometry/test_sphere.cpp

#include <optional>

#include "pathscope/math/ray.hpp"

namespace pathscope {

struct SphereHit {
    float t = 0;
    Vec3 position;        ///< On the sphere: projected along the radius.
    Vec3 position_error;  ///< As in SurfacePoint.
    Vec3 normal;          ///< Outward, of length one.
};

/// The nearer of the two hits with t in [ray.t_min, ray.t_max]; from inside, the far one.
[[nodiscard]] std::optional<SphereHit> intersect_sphere(const Ray& ray, Vec3 centre, float radius);

/// Bound of the error of a point of a sphere that was computed in double and rounded to float once.
[[nodiscard]] Vec3 sphere_point_error(Vec3 position, float radius);

}  // namespace pathscope
