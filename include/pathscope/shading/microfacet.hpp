#pragma once
/// Rough reflection by microfacets: GGX normals, Smith's shadowing, and how to sample what is visible.
///
///   f = D(h) F V(wo, wi),   V = G / (4 cos_o cos_i),   h = (wo + wi) / |wo + wi|
///
///   D(h) = alpha^2 / (pi (h_x^2 + h_y^2 + alpha^2 h_z^2)^2)                density of facet normals
///   V    = 1 / (2 (cos_o t(wi) + cos_i t(wo))),  t(w) = |(alpha w_x, alpha w_y, w_z)|
///
/// G is Smith's, correlated in height: facets that wo sees are high up, so wi likely sees them as well.
/// Sums of squares replace the usual 1 + cos^2 (alpha^2 - 1), which cancels where alpha is small.
///
/// Convention: local frame, z = shading normal; alpha = roughness^2, in [k_min_alpha, 1]; both directions
/// have z > 0 unless said otherwise.
/// See: Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces"; Heitz 2014,
///      "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs".
/// Test: tests/shading/test_microfacet.cpp

#include <algorithm>
#include <cmath>

#include "pathscope/math/vec.hpp"
#include "pathscope/sampling/unit_circle.hpp"

namespace pathscope {

/// Below this a lobe is narrower than floats resolve: its peak, 1 / (pi alpha^2), is 3e5.
inline constexpr float k_min_alpha = 1e-3f;

[[nodiscard]] constexpr float square(float x) { return x * x; }

/// Facet normals per area and solid angle; the projected area, integral of D cos, is 1.
[[nodiscard]] constexpr float ggx_distribution(Vec3 half, float alpha) {
    const float alpha2 = alpha * alpha;
    return k_inv_pi * alpha2 / square(square(half.x) + square(half.y) + alpha2 * square(half.z));
}

/// t(w): length of w after the stretch that turns the GGX surface into a hemisphere.
[[nodiscard]] inline float ggx_stretched_length(Vec3 w, float alpha) {
    return std::sqrt(square(alpha) * (square(w.x) + square(w.y)) + square(w.z));
}

/// The stretched length is that of `outgoing`.
[[nodiscard]] inline float ggx_visibility(Vec3 outgoing, float stretched_length, Vec3 incoming, float alpha) {
    return 0.5f / (outgoing.z * ggx_stretched_length(incoming, alpha) + incoming.z * stretched_length);
}
[[nodiscard]] inline float ggx_visibility(Vec3 outgoing, Vec3 incoming, float alpha) {
    return ggx_visibility(outgoing, ggx_stretched_length(outgoing, alpha), incoming, alpha);
}

// ---- Sampling reflections about the normals that `outgoing` sees.
//
// Heitz 2018 ("Sampling the GGX Distribution of Visible Normals"): stretched by (alpha, alpha, 1), the facets
// become those of a hemisphere. Dupuy & Benyoub 2023 ("Sampling Visible GGX Normals with Spherical Caps"):
// light from wo that a smooth hemisphere reflects is uniform over the cap z >= -wo_z, so the visible normal
// lies halfway between wo and a uniform point of that cap. Eto & Tokuyoshi 2023 ("Bounded VNDF Sampling for
// Smith-GGX Reflections"): part of that cap can only lead to reflections below the horizon; ending it at
// z = -k wo_z instead loses none above it.

/// k in [0, 1]: 0 for alpha = 1 (half the sphere is enough), nearly 1 for smooth surfaces.
[[nodiscard]] inline float ggx_cap_bound(Vec3 outgoing, float alpha) {
    const float alpha2 = alpha * alpha;
    const float s2 = square(1 + std::sqrt(square(outgoing.x) + square(outgoing.y)));
    return (1 - alpha2) * s2 / (s2 + alpha2 * square(outgoing.z));
}

/// May return a direction below the horizon (z <= 0): nothing is reflected there, the sample is lost.
/// Requires: outgoing.z > 0; u in [0, 1)^2.
[[nodiscard]] inline Vec3 sample_ggx_reflection(Vec3 outgoing, float alpha, Vec2 u) {
    const Vec3 stretched = normalize({alpha * outgoing.x, alpha * outgoing.y, outgoing.z});
    const float cap_end = ggx_cap_bound(outgoing, alpha) * stretched.z;
    const float z = 1 - u.y * (1 + cap_end);
    const Vec2 circle = unit_circle(u.x) * std::sqrt(std::max(0.0f, 1 - z * z));
    const Vec3 halfway = stretched + Vec3{circle.x, circle.y, z};
    const Vec3 normal = normalize({alpha * halfway.x, alpha * halfway.y, halfway.z});
    return reflect(outgoing, normal);
}

/// 2 (k cos_o + t(wo)): D(h) over this is the density of a reflection. The stretched length is that of `outgoing`.
[[nodiscard]] inline float ggx_facets_over_pdf(Vec3 outgoing, float stretched_length, float alpha) {
    return 2 * (ggx_cap_bound(outgoing, alpha) * outgoing.z + stretched_length);
}

/// pdf_solid_angle = D(h) / (2 (k cos_o + t(wo))), where incoming.z > 0; half is that of the two directions.
[[nodiscard]] inline float sample_ggx_reflection_pdf(Vec3 outgoing, Vec3 half, float alpha) {
    return ggx_distribution(half, alpha) /
           ggx_facets_over_pdf(outgoing, ggx_stretched_length(outgoing, alpha), alpha);
}

}  // namespace pathscope
