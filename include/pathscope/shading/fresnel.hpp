#pragma once
/// Fresnel: how much of the light a smooth boundary reflects, by angle.
///
///   Schlick:     F(c) = f0 + (f90 - f0) (1 - c)^5
///   dielectric:  F = (r_s^2 + r_p^2) / 2,   r_s = (c_i - eta c_t) / (c_i + eta c_t),
///                                           r_p = (eta c_i - c_t) / (eta c_i + c_t)
///
/// c is the cosine between the direction and the normal (of the microfacet, where there are any), eta the
/// refractive index on the far side over that on the near side. The other share, 1 - F, is transmitted.
/// See: Schlick 1994, "An Inexpensive BRDF Model for Physically-based Rendering"; Born & Wolf, "Principles of
///      Optics", 1.5.2.
/// Test: tests/shading/test_fresnel.cpp

#include <algorithm>
#include <cmath>

#include "pathscope/math/vec.hpp"

namespace pathscope {

/// (1 - c)^5. Requires: c >= 0.
[[nodiscard]] constexpr float schlick_weight(float cosine) {
    const float m = std::max(0.0f, 1 - cosine), m2 = m * m;
    return m2 * m2 * m;
}

[[nodiscard]] constexpr float fresnel_schlick(float f0, float f90, float cosine) {
    return f0 + (f90 - f0) * schlick_weight(cosine);
}
[[nodiscard]] constexpr Rgb fresnel_schlick(Rgb f0, float f90, float cosine) {
    return f0 + (Rgb{f90, f90, f90} - f0) * schlick_weight(cosine);
}

/// Cosine on the far side by Snell's law, sin_t = sin_i / eta; 0 beyond the critical angle.
/// Requires: cosine in [0, 1], eta > 0.
[[nodiscard]] inline float refracted_cosine(float cosine, float eta) {
    const float sine2_far = (1 - cosine * cosine) / (eta * eta);
    return std::sqrt(std::max(0.0f, 1 - sine2_far));
}

/// Exact reflectance for unpolarised light; 1 where all of it is reflected inside (eta < 1, flat angles).
/// Requires: cosine in [0, 1], eta > 0.
[[nodiscard]] inline float fresnel_dielectric(float cosine, float eta) {
    const float far = refracted_cosine(cosine, eta);
    if (far == 0) return 1;
    const float r_s = (cosine - eta * far) / (cosine + eta * far);
    const float r_p = (eta * cosine - far) / (eta * cosine + far);
    return 0.5f * (r_s * r_s + r_p * r_p);
}

/// A pane reflects r at the first boundary, and what enters goes to and fro between the two:
/// R = r + (1 - r)^2 r (1 + r^2 + r^4 + ...) = 2 r / (1 + r). Nothing is absorbed: the rest comes through.
[[nodiscard]] constexpr float pane_reflectance(float boundary_reflectance) {
    return 2 * boundary_reflectance / (1 + boundary_reflectance);
}

}  // namespace pathscope
