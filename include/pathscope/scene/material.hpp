#pragma once
/// What a surface is made of, as the loader hands it to the shading code.
///
/// The values are those of an MTL file, brought into one form (src/scene/mtl.cpp):
///
///   MTL                          here
///   Kd, map_Kd                   kd, map_kd: diffuse albedo
///   Ks, map_Ks                   ks, map_ks: specular reflectance at normal incidence (F0)
///   Ke, map_Ke                   ke, map_ke: emitted radiance
///   Ns                           alpha = sqrt(2 / (Ns + 2)), roughness = sqrt(alpha)
///   Pr, map_Pr                   roughness, map_roughness; Pr wins over Ns
///   Pm                           metallic, folded into kd and ks (below)
///   d; Tr where there is no d    opacity = d = 1 - Tr
///   map_d                        map_d: cut out where it is below 0.5
///   illum 0, 1                   lambert: no highlight, whatever Ks says
///   illum 2, 3, 8, 10 or none    standard
///   illum 5                      mirror of tint ks
///   illum 7, 9                   dielectric of index Ni
///   illum 4, 6                   thin_glass (a window pane: light goes straight through)
///
/// Tf and Kt are ignored: taken literally, the Tf 0.1 of common files turns glass black. Bump, displacement
/// and reflection maps, Ka and map_Ka are ignored. Kd + Ks above 1 is allowed; the BSDF conserves energy.
/// Thread safety: values.   Test: tests/scene/test_mtl.cpp

#include <array>
#include <cstdint>
#include <string>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/math/vec.hpp"

namespace pathscope {

/// How all materials of a scene are taken.
enum class MaterialModel {
    frostbite,  ///< As described above; `standard` is the Frostbite standard material.
    lambert,  ///< Every surface that is no emitter is kd / pi with map_kd and cut-outs; emitters reflect nothing.
};
inline constexpr std::array k_material_model_names{
    EnumName{MaterialModel::frostbite, "frostbite"},
    EnumName{MaterialModel::lambert, "lambert"},
};
constexpr const auto& enum_table(MaterialModel) { return k_material_model_names; }

enum class MaterialKind {
    standard,    ///< Diffuse kd under a rough specular coat of F0 = ks.
    lambert,     ///< kd / pi.
    mirror,      ///< Perfect mirror, tint ks.
    dielectric,  ///< Smooth boundary to a medium of index ior, inside on the side away from the normal.
    thin_glass,  ///< A pane with both boundaries in one surface; no refraction.
};
inline constexpr std::array k_material_kind_names{
    EnumName{MaterialKind::standard, "standard"},     EnumName{MaterialKind::lambert, "lambert"},
    EnumName{MaterialKind::mirror, "mirror"},         EnumName{MaterialKind::dielectric, "dielectric"},
    EnumName{MaterialKind::thin_glass, "thin_glass"},
};
constexpr const auto& enum_table(MaterialKind) { return k_material_kind_names; }

/// A texture at a scale: it is looked up at uv * scale + offset (the -s and -o of MTL).
struct TextureUse {
    std::int32_t index = -1;  ///< In SceneParts::textures; -1 = none.
    Vec2 scale{1, 1};
    Vec2 offset{0, 0};

    explicit operator bool() const { return index >= 0; }
    [[nodiscard]] Vec2 at(Vec2 uv) const { return {uv.x * scale.x + offset.x, uv.y * scale.y + offset.y}; }

    friend bool operator==(const TextureUse&, const TextureUse&) = default;
};

/// Where a map and a value are given, the two are multiplied (map_d and map_roughness stand alone).
struct Material {
    std::string name;
    MaterialKind kind = MaterialKind::standard;
    Rgb kd{0, 0, 0};      ///< Diffuse albedo; already without the share of a metal.
    Rgb ks{0, 0, 0};      ///< F0 of the specular layer, or tint of a mirror.
    Rgb ke{0, 0, 0};      ///< Emitted radiance; zero = no emitter.
    float roughness = 1;  ///< Perceptual: the alpha of GGX is roughness squared. 0 = smooth.
    float metallic = 0;   ///< As given; the loader has folded it: kd *= 1 - m, ks = lerp(ks, kd, m).
                          ///< A metal written as Kd 0, Ks = F0 (with Pm 1) keeps its Ks.
    float ior = 1.5f;     ///< Of dielectric and thin_glass.
    float opacity = 1;  ///< Below 1: the share of light that goes straight on is 1 - opacity. Not for glass.
    bool two_sided_emission = true;

    TextureUse map_kd, map_ks, map_ke;  ///< Colours.
    TextureUse map_d, map_roughness;    ///< Grey; map_roughness replaces roughness.

    [[nodiscard]] bool emits() const { return !is_zero(ke); }

    friend bool operator==(const Material&, const Material&) = default;
};

/// A surface is there where its map_d is at least this.
inline constexpr float k_cutout_threshold = 0.5f;

}  // namespace pathscope
