#pragma once
/// How much of the light from a rough surface's each part comes back, by angle and roughness: a table.
///
///   specular:  E_s(cos) = ∫ D F V cos_i dwi = f0 * scale + f90 * bias      (Schlick's F is linear in f0, f90)
///   diffuse:   E_d(cos) = ∫ f_diffuse / albedo cos_i dwi
///
/// Why: the standard material must know what its specular coat takes before it lets the base have the rest,
/// and which lobe is worth a sample. Frostbite keeps the very same three numbers in a texture for its
/// image-based lights ("pre-integrated DFG").
/// Interpolated bilinearly over 32 x 32 nodes; made on first use, in some 50 ms, from sums, products and square
/// roots only, so with the same bits everywhere. Error: below 0.012, and 0.003 in the mean.
/// See: Lagarde & de Rousiers 2014, "Moving Frostbite to PBR", 4.9.2; Karis 2013, "Real Shading in Unreal
///      Engine 4".
/// Thread safety: yes.   Test: tests/shading/test_energy.cpp

#include "pathscope/math/vec.hpp"

namespace pathscope {

struct alignas(16) LobeAlbedos {
    float scale = 0;    ///< Multiplies f0 in the specular albedo.
    float bias = 0;     ///< Multiplies f90 in it.
    float diffuse = 0;  ///< Albedo of Frostbite's diffuse lobe with a white base.

    [[nodiscard]] Rgb specular(Rgb f0, float f90) const { return f0 * scale + Rgb{1, 1, 1} * (f90 * bias); }
};

/// The table at one roughness, for looking up several angles.
class AlbedoRow {
  public:
    /// Requires: roughness (linear) in [0, 1].
    explicit AlbedoRow(float roughness);

    /// Requires: cosine in [0, 1].
    [[nodiscard]] LobeAlbedos at(float cosine) const;

  private:
    const LobeAlbedos* low_;   // the rows of nodes below
    const LobeAlbedos* high_;  // and above this roughness
    float between_;
};

}  // namespace pathscope
