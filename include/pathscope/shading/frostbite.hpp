#pragma once
/// The Frostbite standard material: a rough specular coat over a diffuse base.
///
///   f = f_specular + f_diffuse
///   f_specular = D(h) V(wo, wi) F(cos_d),    F by Schlick, f90 = saturate(50 * dot(f0, 0.33))
///   f_diffuse  = rho(wo, wi) * S(wo, wi),    S: Disney diffuse with renormalised energy (diffuse.hpp)
///
/// D and V as in microfacet.hpp with alpha = roughness^2 (GGX, height-correlated Smith); h the half vector,
/// cos_d = wo . h. f90 below 1 lets a specular colour of zero mean no specular at all.
///
/// Where this differs from the paper, and why. There rho is the base colour. Coat and base then reflect
/// together up to 1.1 of what arrives (white base, f0 = 0.04, grazing angles), and far more for files whose
/// diffuse and specular colours sum to more than 1. Here the base gets at most what the coat leaves,
///
///   rho = min(diffuse, L(wo), L(wi)),   L(w) = (1 - margin - E_s(w)) / E_d(w),   per colour channel,
///
/// with the albedos E_s and E_d from Frostbite's own pre-integrated table (albedo_table.hpp). The minimum of
/// both directions keeps Helmholtz reciprocity, and
///
///   E(wo) <= E_s(wo) + L(wo) E_d(wo) <= 1   for every direction, roughness, diffuse and f0.
///
/// Where diffuse is below both limits, f is the paper's: for diffuse <= 0.85 and f0 <= 0.05 always if the
/// roughness is at least 0.3, and for a smoother surface at cosines above 0.2.
///
/// As in the paper, light that would bounce between facets is lost: in a white furnace, seen along the normal, a
/// white metal lacks 0.2 % at roughness 0.2, 18 % at 0.6 and 69 % at 1 (test_energy.cpp has the table).
/// Roughness below 0.032 is taken as 0.032 (k_min_alpha).
///
/// See:  Lagarde & de Rousiers 2014, "Moving Frostbite to Physically Based Rendering", 3.1 and listings 2-3.
/// Test: tests/shading/test_energy.cpp, test_bsdf.cpp, test_sampling.cpp

#include <algorithm>

#include "pathscope/math/vec.hpp"
#include "pathscope/shading/albedo_table.hpp"
#include "pathscope/shading/bsdf.hpp"
#include "pathscope/shading/microfacet.hpp"

namespace pathscope {

[[nodiscard]] constexpr float alpha_from_roughness(float roughness) {
    return std::max(roughness * roughness, k_min_alpha);
}

[[nodiscard]] constexpr float f90_from_f0(Rgb f0) {
    return std::clamp(50 * 0.33f * (f0.x + f0.y + f0.z), 0.0f, 1.0f);
}

/// What coat and base do with light leaving (or, by reciprocity, arriving) along one direction.
struct StandardShare {
    Rgb specular;             ///< E_s: albedo of the coat.
    Rgb diffuse_limit;        ///< L: the largest base colour that the rest of the light allows.
    float white_diffuse = 0;  ///< E_d: albedo of the diffuse lobe over a white base.
};

/// The material as seen along one direction: what all that is asked along it has in common.
struct StandardView {
    StandardSurface surface;
    Vec3 outgoing;
    float alpha;
    float f90;
    AlbedoRow albedos;
    StandardShare share;         ///< Along `outgoing`.
    float specular_probability;  ///< Of the coat, in sample_standard.
    float stretched_length;      ///< t(wo) of microfacet.hpp.
    float facets_over_pdf;       ///< 2 (k cos_o + t(wo)): what turns D into the density of a reflection.

    /// Requires: outgoing.z >= 0.
    StandardView(const StandardSurface& surface, Vec3 outgoing);
};

/// Value without the cosine, and density of sample_standard. Zero unless both directions have z > 0.
[[nodiscard]] BsdfValue eval_standard(const StandardView& view, Vec3 incoming);

/// Draws a reflection about a visible facet or a cosine-distributed direction, each as often as its lobe's
/// share of the light reflected towards `outgoing`; value and density as eval_standard gives them. Where the
/// direction is below the surface, both are zero.
/// Requires: outgoing.z > 0; u_lobe and u in [0, 1).
struct DirectionSample {
    Vec3 incoming;
    BsdfValue value;
};
[[nodiscard]] DirectionSample sample_standard(const StandardView& view, float u_lobe, Vec2 u);

/// Directional albedo from the table; see guide_albedo().
[[nodiscard]] Rgb standard_albedo(const StandardSurface& surface, Vec3 outgoing);

}  // namespace pathscope
