#include "pathscope/shading/frostbite.hpp"

#include "pathscope/sampling/warp.hpp"
#include "pathscope/shading/albedo_table.hpp"
#include "pathscope/shading/diffuse.hpp"
#include "pathscope/shading/fresnel.hpp"

namespace pathscope {
namespace {

/// Covers the table's interpolation error, so that the sum stays below 1 between its nodes as well.
constexpr float k_energy_margin = 0.01f;

StandardShare share_along(const StandardView& view, float cosine) {
    const LobeAlbedos lobes = view.albedos.at(cosine);
    const Rgb specular = lobes.specular(view.surface.f0, view.f90);
    constexpr float k_all = 1 - k_energy_margin;
    return {specular, max(Rgb{k_all, k_all, k_all} - specular, {}) / lobes.diffuse, lobes.diffuse};
}

/// The base's part of the directional albedo, as far as this direction limits it.
Rgb base_albedo(const StandardView& view) {
    return min(view.surface.diffuse, view.share.diffuse_limit) * view.share.white_diffuse;
}

BsdfValue evaluate(const StandardView& view, Vec3 incoming) {
    const Vec3 outgoing = view.outgoing;
    const Vec3 half = normalize(outgoing + incoming);
    const float cos_difference = std::min(dot(outgoing, half), 1.0f);

    // The coat.
    const float distribution = ggx_distribution(half, view.alpha);
    const float visibility = ggx_visibility(outgoing, view.stretched_length, incoming, view.alpha);
    const Rgb specular =
        fresnel_schlick(view.surface.f0, view.f90, cos_difference) * (distribution * visibility);

    // The base, which gets what the coat leaves along both directions.
    const Rgb limit = min(view.share.diffuse_limit, share_along(view, incoming.z).diffuse_limit);
    const Rgb diffuse =
        min(view.surface.diffuse, limit) *
        eval_frostbite_diffuse(outgoing.z, incoming.z, cos_difference, view.surface.roughness);

    const float pdf = lerp(sample_cosine_hemisphere_pdf(incoming), distribution / view.facets_over_pdf,
                           view.specular_probability);
    return {specular + diffuse, pdf};
}

}  // namespace

StandardView::StandardView(const StandardSurface& seen, Vec3 from)
    : surface(seen),
      outgoing(from),
      alpha(alpha_from_roughness(seen.roughness)),
      f90(f90_from_f0(seen.f0)),
      albedos(seen.roughness),
      share(share_along(*this, from.z)),
      stretched_length(ggx_stretched_length(from, alpha)),
      facets_over_pdf(ggx_facets_over_pdf(from, stretched_length, alpha)) {
    const Rgb base = base_albedo(*this);
    const float specular = share.specular.x + share.specular.y + share.specular.z;
    const float sum = specular + base.x + base.y + base.z;
    specular_probability = sum > 0 ? specular / sum : 0;
}

BsdfValue eval_standard(const StandardView& view, Vec3 incoming) {
    if (!(view.outgoing.z > 0 && incoming.z > 0)) return {};  // a NaN is not reflected either
    return evaluate(view, incoming);
}

DirectionSample sample_standard(const StandardView& view, float u_lobe, Vec2 u) {
    const Vec3 incoming = u_lobe < view.specular_probability
                              ? sample_ggx_reflection(view.outgoing, view.alpha, u)
                              : sample_cosine_hemisphere(u);
    if (!(incoming.z > 0)) return {incoming, {}};
    return {incoming, evaluate(view, incoming)};
}

Rgb standard_albedo(const StandardSurface& surface, Vec3 outgoing) {
    const StandardView view(surface, {outgoing.x, outgoing.y, std::abs(outgoing.z)});
    return view.share.specular + base_albedo(view);
}

}  // namespace pathscope
