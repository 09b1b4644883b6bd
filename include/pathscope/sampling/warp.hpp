#pragma once
/// Warps: from a uniform point of the unit square to points and directions, each beside its density.
///
///   sample_X(u) has the density sample_X_pdf(...) in the measure named there.
///
/// Convention: directions are in a local frame with z up. Every warp is continuous and keeps neighbours
/// together, so that the stratification of a low-discrepancy sampler survives it.
/// Requires: u in [0, 1)^2.
/// See: Shirley & Chiu 1997, "A Low Distortion Map Between Disk and Square"; Heitz 2019, "A Low-Distortion
///      Map Between Triangle and Square".
/// Test: tests/sampling/test_warp.cpp (chi-square of each against its density)

#include <algorithm>
#include <cmath>

#include "pathscope/math/vec.hpp"
#include "pathscope/sampling/unit_circle.hpp"

namespace pathscope {

// ---- Disc of radius 1: pdf_area = 1 / pi.

[[nodiscard]] inline Vec2 sample_disc(Vec2 u) {
    const float a = 2 * u.x - 1, b = 2 * u.y - 1;
    // Squares around the centre become circles; a negative radius reaches the other half.
    const bool flat = std::abs(a) > std::abs(b);
    const float radius = flat ? a : b, other = flat ? b : a;
    if (radius == 0) return {0, 0};
    const Vec2 p = cos_sin_small((k_pi / 4) * (other / radius)) * radius;
    return {flat ? p.x : p.y, flat ? p.y : p.x};
}
[[nodiscard]] constexpr float sample_disc_pdf() { return k_inv_pi; }

// ---- Triangle: pdf_area = 1 / area.

/// Barycentric weights {b1, b2} of the point (1 - b1 - b2) p0 + b1 p1 + b2 p2.
[[nodiscard]] constexpr Vec2 sample_triangle(Vec2 u) {
    // The smaller of the two is halved, and the larger loses as much. No branch: random numbers would make the
    // processor guess wrong.
    const float half = 0.5f * std::min(u.x, u.y);
    return {u.x - half, u.y - half};
}
/// Requires: area > 0.
[[nodiscard]] constexpr float sample_triangle_pdf(float area) { return 1 / area; }

// ---- Cone around z: pdf_solid_angle = 1 / (2 pi (1 - cos)).

/// The cone is given by 1 - cos of its half angle, not by the cosine: for the sun (half angle 0.27 degrees)
/// that is 1.1e-5, of which a float cosine keeps less than three digits.
[[nodiscard]] inline Vec3 sample_cone(Vec2 u, float one_minus_cos_max) {
    const float one_minus_cos = u.x * one_minus_cos_max;
    const float sine = std::sqrt(std::max(0.0f, one_minus_cos * (2 - one_minus_cos)));
    const Vec2 p = unit_circle(u.y) * sine;
    return {p.x, p.y, 1 - one_minus_cos};
}
/// Inside the cone; the caller knows whether a direction is. Requires: one_minus_cos_max in (0, 2].
[[nodiscard]] constexpr float sample_cone_pdf(float one_minus_cos_max) {
    return k_inv_pi * 0.5f / one_minus_cos_max;
}
/// 1 - cos of an angle from the square of its sine, exact for small angles. Requires: angle <= pi / 2.
[[nodiscard]] inline float one_minus_cos_from_sin2(float sine_squared) {
    return sine_squared / (1 + std::sqrt(std::max(0.0f, 1 - sine_squared)));
}

// ---- Sphere: pdf_solid_angle = 1 / (4 pi).

[[nodiscard]] inline Vec3 sample_uniform_sphere(Vec2 u) { return sample_cone(u, 2); }
[[nodiscard]] constexpr float sample_uniform_sphere_pdf() { return k_inv_pi / 4; }

// ---- Hemisphere, uniform: pdf_solid_angle = 1 / (2 pi) where z > 0.

[[nodiscard]] inline Vec3 sample_uniform_hemisphere(Vec2 u) {
    // z = 1 - u is never 0, so that no direction lies in the surface itself.
    return sample_cone(u, 1);
}
[[nodiscard]] constexpr float sample_uniform_hemisphere_pdf(Vec3 direction) {
    return direction.z > 0 ? k_inv_pi / 2 : 0;
}

// ---- Hemisphere, by cosine: pdf_solid_angle = cos / pi where z > 0.

/// Malley's method: a uniform point of the disc, lifted to the sphere, has density cos / pi.
[[nodiscard]] inline Vec3 sample_cosine_hemisphere(Vec2 u) {
    const Vec2 p = sample_disc(u);
    return {p.x, p.y, std::sqrt(std::max(0.0f, 1 - p.x * p.x - p.y * p.y))};
}
[[nodiscard]] constexpr float sample_cosine_hemisphere_pdf(Vec3 direction) {
    return std::max(0.0f, direction.z) * k_inv_pi;
}

}  // namespace pathscope
