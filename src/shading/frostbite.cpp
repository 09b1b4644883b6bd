#include "pathscope/shading/frostbite.hpp"

#include "pathscope/sampling/warp.hpp"
#include "pathscope/shading/albedo_table.hpp"
#include "pathscope/shading/diffuse.hpp"
#include "pathscope/shading/fresnel.hpp"

namespace pathscope {
namespace {

/// Covers the table's interpolation error, so that the sum stays below 1 between its nodes as well.
constexpr float k_energy_margin = 0.01f;

/// What coat and base do with light leaving (or, by reciprocity, arriving) along one direction.
struct Share {
    Rgb specular;        ///< E_s: albedo of the coat.
    Rgb diffuse_limit;   ///< L: the largest base colour that the rest of the light allows.
    float diffuse_lobe;  ///< E_d: albedo of the diffuse lobe over a white base.
};

Share share_along(const StandardSurface& surface, float f90, float cosine) {
    const LobeAlbedos albedos = lobe_albedos(cosine, surface.roughness);
    const Rgb specular = albedos.specular(surface.f0, f90);
    const Rgb rest = max(Rgb{1 - k_energy_margin, 1 - k_energy_margin, 1 - k_energy_margin} - specular, {});
    return {specular, rest / albedos.diffuse, albedos.diffuse};
}

/// The probability of the specular lobe: its share of the light reflected along `outgoing`, all channels
/// alike.
float specular_probability(const StandardSurface& surface, const Share& share) {
    const Rgb diffuse = min(surface.diffuse, share.diffuse_limit) * share.diffuse_lobe;
    const float specular = share.specular.x + share.specular.y + share.specular.z;
    const float sum = specular + diffuse.x + diffuse.y + diffuse.z;
    return sum > 0 ? specular / sum : 0;
}

}  // namespace

BsdfValue eval_standard(const StandardSurface& surface, Vec3 outgoing, Vec3 incoming) {
    if (outgoing.z <= 0 || incoming.z <= 0) return {};
    const float alpha = alpha_from_roughness(surface.roughness);
    const float f90 = f90_from_f0(surface.f0);
    const Vec3 half = normalize(outgoing + incoming);
    const float cos_difference = std::min(dot(outgoing, half), 1.0f);

    // The coat.
    const float facets = ggx_distribution(half, alpha) * ggx_visibility(outgoing, incoming, alpha);
    const Rgb specular = fresnel_schlick(surface.f0, f90, cos_difference) * facets;

    // The base, which gets what the coat leaves along both directions.
    const Share out = share_along(surface, f90, outgoing.z);
    const Share in = share_along(surface, f90, incoming.z);
    const Rgb base = min(surface.diffuse, min(out.diffuse_limit, in.diffuse_limit));
    const Rgb diffuse =
        base * eval_frostbite_diffuse(outgoing.z, incoming.z, cos_difference, surface.roughness);

    const float pdf =
        lerp(sample_cosine_hemisphere_pdf(incoming), sample_ggx_reflection_pdf(outgoing, half, alpha),
             specular_probability(surface, out));
    return {specular + diffuse, pdf};
}

Vec3 sample_standard(const StandardSurface& surface, Vec3 outgoing, float u_lobe, Vec2 u) {
    const Share out = share_along(surface, f90_from_f0(surface.f0), outgoing.z);
    if (u_lobe < specular_probability(surface, out))
        return sample_ggx_reflection(outgoing, alpha_from_roughness(surface.roughness), u);
    return sample_cosine_hemisphere(u);
}

Rgb standard_albedo(const StandardSurface& surface, Vec3 outgoing) {
    const Share out = share_along(surface, f90_from_f0(surface.f0), std::abs(outgoing.z));
    return out.specular + min(surface.diffuse, out.diffuse_limit) * out.diffuse_lobe;
}

}  // namespace pathscope
