#pragma once
/// Diffuse reflection: Lambert's, and Disney's with Frostbite's renormalised energy.
///
///   Lambert:    f = albedo / pi
///   Frostbite:  f = albedo / pi * S(cos_o) S(cos_i) * lerp(1, 1/1.51, r),   S(c) = 1 + (f90 - 1) (1 - c)^5,
///               f90 = r/2 + 2 r cos_d^2
///
/// r is the linear roughness, cos_d the cosine between either direction and the half vector. A smooth base
/// darkens towards grazing angles (light that Fresnel's law keeps out), a rough one brightens (light thrown
/// back by its bumps). Disney's original reflects up to half more than it receives; the last factor and the
/// r/2 instead of 1/2 are Frostbite's renormalisation.
///
/// See: Burley 2012, "Physically-Based Shading at Disney", 5.3; Lagarde & de Rousiers 2014, "Moving Frostbite
///      to PBR", 3.1.4 and listing 3.
/// Test: tests/shading/test_energy.cpp, test_bsdf.cpp

#include "pathscope/math/vec.hpp"
#include "pathscope/shading/fresnel.hpp"

namespace pathscope {

/// f / albedo. Requires: cosines in [0, 1], roughness in [0, 1].
[[nodiscard]] constexpr float eval_frostbite_diffuse(float cos_outgoing, float cos_incoming,
                                                     float cos_difference, float roughness) {
    const float f90 = 0.5f * roughness + 2 * roughness * cos_difference * cos_difference;
    const float energy = lerp(1.0f, 1 / 1.51f, roughness);
    return k_inv_pi * energy * fresnel_schlick(1, f90, cos_outgoing) * fresnel_schlick(1, f90, cos_incoming);
}

}  // namespace pathscope
