#pragma once
/// A triangle as a point sees it: a part of the sphere of directions, drawn from uniformly.
///
///   pdf_solid_angle = 1 / Ω
///
/// Why: a point drawn uniformly by area has pdf_solid_angle = distance² / (area cos θ'). Close to a large lamp that varies by
/// orders of magnitude from one end of the lamp to the other, and the few samples that land on the near end outshine
/// the picture. By solid angle all samples count the same.
///
/// With unit vectors A, B, C to the corners, the solid angle is (Van Oosterom & Strackee)
///
///   tan(Ω/2) = |A · B×C| / (1 + A·B + B·C + C·A)
///
/// The first number moves C along the edge AC to the C' that leaves the share u.x of the solid angle. C' is A mirrored at a
/// vector m = x A + y C half-way between the two, and in m the formula is linear:
///
///   tan(u.x Ω/2) = |A · B×m| / (A·m + B·m)   =>   x = det cos h - (A + B)·C sin h,   y = (1 + A·B) sin h
///
/// with det = |A · B×C| and h = u.x Ω/2. The second number chooses on the arc from B to C' such that equal areas have equal
/// chances. All of it is sums of A, B, C with weights >= 0, and those divided by the corners' distances are barycentric: no
/// angle is computed but h, and no ray is shot back at the triangle.
///
/// In double, from differences of floats that are exact: thin triangles seen edge-on keep their digits. The numbers that
/// need an angle are floats (unit_circle.hpp); so Ω has an error below 4e-7 of itself.
/// See: Arvo 1995, "Stratified Sampling of Spherical Triangles"; Peters 2021, "BRDF Importance Sampling for Polygonal
/// Lights", whose Ω/2 replaces Arvo's vertex angles; Van Oosterom & Strackee 1983, "The Solid Angle of a Plane Triangle".
/// Thread safety: values.   Test: tests/sampling/test_spherical_triangle.cpp

#include <algorithm>
#include <cmath>

#include "pathscope/math/vec.hpp"
#include "pathscope/sampling/unit_circle.hpp"

namespace pathscope {

struct SphericalTriangle {
    double inverse_a, inverse_b, inverse_c;  ///< 1 / distance of each corner.
    double cos_ab, cos_bc, cos_ca;           ///< Between the directions to them.
    double det;                              ///< |A · B×C|; zero seen edge-on.
    float half_turns;                        ///< Ω/2, in turns: from 0 to 1/2.

    [[nodiscard]] float solid_angle() const { return 4 * k_pi * half_turns; }
};

/// Of the triangle abc, seen from a point. From one of the corners nothing is finite.
[[nodiscard]] inline SphericalTriangle see_triangle(Vec3 from, Vec3 a, Vec3 b, Vec3 c) {
    struct Difference {
        double x, y, z;
        Difference(Vec3 p, Vec3 q) : x(double(p.x) - q.x), y(double(p.y) - q.y), z(double(p.z) - q.z) {}
    };
    const auto dot = [](const Difference& p, const Difference& q) {
        return p.x * q.x + p.y * q.y + p.z * q.z;
    };
    const Difference to_a(a, from), to_b(b, from), to_c(c, from);
    SphericalTriangle seen{};
    seen.inverse_a = 1 / std::sqrt(dot(to_a, to_a));
    seen.inverse_b = 1 / std::sqrt(dot(to_b, to_b));
    seen.inverse_c = 1 / std::sqrt(dot(to_c, to_c));
    seen.cos_ab = dot(to_a, to_b) * seen.inverse_a * seen.inverse_b;
    seen.cos_bc = dot(to_b, to_c) * seen.inverse_b * seen.inverse_c;
    seen.cos_ca = dot(to_c, to_a) * seen.inverse_c * seen.inverse_a;
    const double volume = to_a.x * (to_b.y * to_c.z - to_b.z * to_c.y) +
                          to_a.y * (to_b.z * to_c.x - to_b.x * to_c.z) +
                          to_a.z * (to_b.x * to_c.y - to_b.y * to_c.x);
    seen.det = std::abs(volume) * seen.inverse_a * seen.inverse_b * seen.inverse_c;
    seen.half_turns = turns_of({float(1 + seen.cos_ab + seen.cos_bc + seen.cos_ca), float(seen.det)});
    return seen;
}

/// Barycentric weights {b1, b2} of the point (1 - b1 - b2) a + b1 b + b2 c in the direction drawn.
/// Requires: u in [0, 1)^2; 0 < solid_angle() < 2 pi.
[[nodiscard]] inline Vec2 sample_spherical_triangle(const SphericalTriangle& seen, Vec2 u) {
    // The vector half-way from A to C'. Rounding may carry C' past C.
    const Vec2 h = unit_circle(u.x * seen.half_turns);
    const double y = (1 + seen.cos_ab) * h.y;
    const double x = std::max(y, seen.det * h.x - (seen.cos_ca + seen.cos_bc) * h.y);
    const double am = x + y * seen.cos_ca, bm = x * seen.cos_ab + y * seen.cos_bc;
    const double mm = x * x + y * (2 * x * seen.cos_ca + y);

    // On the arc: s is the cosine of the angle from B; the direction is (s - t end) B + t C'.
    const double end = 2 * am * bm / mm - seen.cos_ab;
    const double s = 1 - u.y * (1 - end);
    const double t = std::sqrt(u.y * (1 + s) / (1 + end));

    // Mirrored at m, A becomes C' = ((x² - y²) A + 2 y (A·m) C) / m².
    const double weight_a = t * (x - y) * (x + y) / mm * seen.inverse_a;
    const double weight_b = std::max(0.0, s - t * end) * seen.inverse_b;
    const double weight_c = t * 2 * y * am / mm * seen.inverse_c;
    const double inverse_sum = 1 / (weight_a + weight_b + weight_c);
    return {float(weight_b * inverse_sum), float(weight_c * inverse_sum)};
}

/// Of a direction inside the triangle; the caller knows whether it is.
[[nodiscard]] inline float sample_spherical_triangle_pdf(const SphericalTriangle& seen) {
    return 1 / seen.solid_angle();
}

}  // namespace pathscope
