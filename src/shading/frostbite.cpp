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
    Rgb specular;             ///< E_s: albedo of the coat.
    Rgb diffuse_limit;        ///< L: the largest base colour that the rest of the light allows.
    float white_diffuse = 0;  ///< E_d: albedo of the diffuse lobe over a white base.
};

/// The material as seen along one direction: what eval and sample have in common.
struct View {
    const StandardSurface& surface;
    Vec3 outgoing;
    float alpha;
    float f90;
    AlbedoRow albedos;
    Share share;
    float specular_probability;

    View(const StandardSurface& seen, Vec3 from)
        : surface(seen),
          outgoing(from),
          alpha(alpha_from_roughness(seen.roughness)),
          f90(f90_from_f0(seen.f0)),
          albedos(seen.roughness),
          share(share_along(from.z)) {
        const Rgb base = base_albedo();
        const float specular = share.specular.x + share.specular.y + share.specular.z;
        const float sum = specular + base.x + base.y + base.z;
        specular_probability = sum > 0 ? specular / sum : 0;
    }

    [[nodiscard]] Share share_along(float cosine) const {
        const LobeAlbedos lobes = albedos.at(cosine);
        const Rgb specular = lobes.specular(surface.f0, f90);
        constexpr float k_all = 1 - k_energy_margin;
        return {specular, max(Rgb{k_all, k_all, k_all} - specular, {}) / lobes.diffuse, lobes.diffuse};
    }

    /// The base's part of the directional albedo, as far as this direction limits it.
    [[nodiscard]] Rgb base_albedo() const {
        return min(surface.diffuse, share.diffuse_limit) * share.white_diffuse;
    }
};

BsdfValue evaluate(const View& view, Vec3 incoming) {
    const Vec3 outgoing = view.outgoing;
    const Vec3 half = normalize(outgoing + incoming);
    const float cos_difference = std::min(dot(outgoing, half), 1.0f);

    // The coat.
    const float facets = ggx_distribution(half, view.alpha) * ggx_visibility(outgoing, incoming, view.alpha);
    const Rgb specular = fresnel_schlick(view.surface.f0, view.f90, cos_difference) * facets;

    // The base, which gets what the coat leaves along both directions.
    const Rgb limit = min(view.share.diffuse_limit, view.share_along(incoming.z).diffuse_limit);
    const Rgb diffuse =
        min(view.surface.diffuse, limit) *
        eval_frostbite_diffuse(outgoing.z, incoming.z, cos_difference, view.surface.roughness);

    const float pdf = lerp(sample_cosine_hemisphere_pdf(incoming),
                           sample_ggx_reflection_pdf(outgoing, half, view.alpha), view.specular_probability);
    return {specular + diffuse, pdf};
}

}  // namespace

BsdfValue eval_standard(const StandardSurface& surface, Vec3 outgoing, Vec3 incoming) {
    if (!(outgoing.z > 0 && incoming.z > 0)) return {};  // a NaN is not reflected either
    return evaluate(View(surface, outgoing), incoming);
}

DirectionSample sample_standard(const StandardSurface& surface, Vec3 outgoing, float u_lobe, Vec2 u) {
    const View view(surface, outgoing);
    const Vec3 incoming = u_lobe < view.specular_probability ? sample_ggx_reflection(outgoing, view.alpha, u)
                                                             : sample_cosine_hemisphere(u);
    if (!(incoming.z > 0)) return {incoming, {}};
    return {incoming, evaluate(view, incoming)};
}

Rgb standard_albedo(const StandardSurface& surface, Vec3 outgoing) {
    const View view(surface, {outgoing.x, outgoing.y, std::abs(outgoing.z)});
    return view.share.specular + view.base_albedo();
}

}  // namespace pathscope
