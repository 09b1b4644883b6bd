#include "pathscope/shading/bsdf.hpp"

#include "pathscope/sampling/warp.hpp"
#include "pathscope/shading/fresnel.hpp"
#include "pathscope/shading/frostbite.hpp"
#include "pathscope/shading/seen_bsdf.hpp"

namespace pathscope {
namespace {

template <class Kind>
constexpr bool k_is_delta = !std::is_same_v<Kind, Lambert> && !std::is_same_v<Kind, StandardSurface>;

// ---- Value and density, one overload for each kind.

BsdfValue evaluate(const Lambert& surface, const SeenBsdf& seen, Vec3 incoming) {
    if (!(seen.outgoing.z > 0 && incoming.z > 0)) return {};
    return {surface.albedo * k_inv_pi, sample_cosine_hemisphere_pdf(incoming)};
}

BsdfValue evaluate(const StandardSurface&, const SeenBsdf& seen, Vec3 incoming) {
    return seen.standard ? eval_standard(*seen.standard, incoming) : BsdfValue{};
}

template <class Delta>
BsdfValue evaluate(const Delta&, const SeenBsdf&, Vec3) {
    static_assert(k_is_delta<Delta>);
    return {};
}

BsdfValue evaluate(const SeenBsdf& seen, Vec3 incoming) {
    const Bsdf& bsdf = seen.bsdf;
    const BsdfValue value =
        std::visit([&](const auto& surface) { return evaluate(surface, seen, incoming); }, bsdf.surface);
    return {value.value * bsdf.opacity, value.pdf_solid_angle * bsdf.opacity};
}

/// The density of the hemisphere's levers. Where nothing is reflected nothing is drawn.
float hemisphere_pdf(HemisphereSampling sampling, Vec3 outgoing, Vec3 incoming) {
    if (outgoing.z <= 0) return 0;
    return sampling == HemisphereSampling::uniform ? sample_uniform_hemisphere_pdf(incoming)
                                                   : sample_cosine_hemisphere_pdf(incoming);
}

// ---- Samples of delta lobes.

BsdfSample delta_sample(Vec3 incoming, Rgb weight) {
    BsdfSample sample;
    sample.incoming = incoming;
    sample.weight = weight;
    sample.specular = true;
    return sample;
}

BsdfSample straight_sample(Vec3 outgoing, Rgb weight) {
    BsdfSample sample = delta_sample(-outgoing, weight);
    sample.straight = true;
    return sample;
}

Vec3 mirrored(Vec3 outgoing) { return {-outgoing.x, -outgoing.y, outgoing.z}; }

BsdfSample sample_delta(const Mirror& surface, Vec3 outgoing, float) {
    return delta_sample(mirrored(outgoing), surface.tint);
}

/// Reflects with probability F, which cancels the F of the weight; likewise for what is transmitted.
BsdfSample sample_delta(const Dielectric& surface, Vec3 outgoing, float u_lobe) {
    const bool outside = outgoing.z > 0;
    const float eta = outside ? surface.eta : 1 / surface.eta;  // far side over near side
    const float cosine = std::min(std::abs(outgoing.z), 1.0f);
    if (u_lobe < fresnel_dielectric(cosine, eta)) return delta_sample(mirrored(outgoing), {1, 1, 1});

    const float far = refracted_cosine(cosine, eta);
    const Vec3 incoming = normalize({-outgoing.x / eta, -outgoing.y / eta, outside ? -far : far});
    // Snell's law squeezes the far side's solid angle by eta^2 into the near side's: radiance L / n^2 is what
    // a boundary keeps. Entering and leaving a body cancel; in between, radiance is in units of the inside.
    BsdfSample sample = delta_sample(incoming, surface.tint * (1 / (eta * eta)));
    sample.compression = 1 / (eta * eta);
    return sample;
}

Rgb pane_transmission(const ThinGlass& surface, Vec3 outgoing) {
    const float cosine = std::min(std::abs(outgoing.z), 1.0f);
    return surface.tint * (1 - pane_reflectance(fresnel_dielectric(cosine, surface.eta)));
}

BsdfSample sample_delta(const ThinGlass& surface, Vec3 outgoing, float u_lobe) {
    const float cosine = std::min(std::abs(outgoing.z), 1.0f);
    if (u_lobe < pane_reflectance(fresnel_dielectric(cosine, surface.eta)))
        return delta_sample(mirrored(outgoing), {1, 1, 1});
    return straight_sample(outgoing, surface.tint);
}

// ---- Samples of the others: a direction with its value and density.

template <class Smooth>
DirectionSample sample_hemisphere(HemisphereSampling sampling, const Smooth& surface, const SeenBsdf& seen,
                                  Vec2 u) {
    const Vec3 incoming =
        sampling == HemisphereSampling::uniform ? sample_uniform_hemisphere(u) : sample_cosine_hemisphere(u);
    const Rgb value = evaluate(surface, seen, incoming).value;
    return {incoming, {value, hemisphere_pdf(sampling, seen.outgoing, incoming)}};
}

/// Drawn by the cosine, so that the weight is the albedo. Requires: seen from above.
std::optional<BsdfSample> sample_by_cosine(const Lambert& surface, const SeenBsdf& seen, Vec2 u) {
    std::optional<BsdfSample> sample;
    const Vec3 incoming = sample_cosine_hemisphere(u);
    if (!(incoming.z > 0) || is_zero(surface.albedo)) return sample;
    sample.emplace();
    sample->incoming = incoming;
    sample->value = surface.albedo * (k_inv_pi * seen.bsdf.opacity);
    sample->pdf_solid_angle = sample_cosine_hemisphere_pdf(incoming) * seen.bsdf.opacity;
    sample->weight = surface.albedo;
    return sample;
}

/// Nothing if no light can come from there.
template <class Kind>
std::optional<BsdfSample> sample_surface(HemisphereSampling sampling, const Kind& surface,
                                         const SeenBsdf& seen, float u_lobe, Vec2 u) {
    if constexpr (k_is_delta<Kind>) {
        const BsdfSample sample = sample_delta(surface, seen.outgoing, u_lobe);
        return is_zero(sample.weight) ? std::nullopt : std::optional(sample);
    } else {
        std::optional<BsdfSample> sample;
        if (!(seen.outgoing.z > 0)) return sample;
        if constexpr (std::is_same_v<Kind, Lambert>)
            if (sampling != HemisphereSampling::uniform) return sample_by_cosine(surface, seen, u);
        const DirectionSample drawn = [&] {
            if constexpr (std::is_same_v<Kind, StandardSurface>)
                if (sampling == HemisphereSampling::bsdf) return sample_standard(*seen.standard, u_lobe, u);
            return sample_hemisphere(sampling, surface, seen, u);
        }();
        const float pdf = drawn.value.pdf_solid_angle;
        const Rgb weight = drawn.value.value * (drawn.incoming.z / pdf);
        if (!(pdf > 0) || is_zero(weight)) return sample;
        sample.emplace();
        sample->incoming = drawn.incoming;
        sample->value = drawn.value.value * seen.bsdf.opacity;
        sample->pdf_solid_angle = pdf * seen.bsdf.opacity;
        sample->weight = weight;
        return sample;
    }
}

}  // namespace

bool is_specular(const Bsdf& bsdf) {
    return bsdf.opacity <= 0 ||
           std::visit([]<class Kind>(const Kind&) { return k_is_delta<Kind>; }, bsdf.surface);
}

BsdfValue eval_bsdf_and_pdf(HemisphereSampling sampling, const SeenBsdf& seen, Vec3 incoming) {
    BsdfValue value = evaluate(seen, incoming);
    if (sampling != HemisphereSampling::bsdf && !is_specular(seen.bsdf))
        value.pdf_solid_angle = seen.bsdf.opacity * hemisphere_pdf(sampling, seen.outgoing, incoming);
    return value;
}

std::optional<BsdfSample> sample_direction(HemisphereSampling sampling, const SeenBsdf& seen, float u_lobe,
                                           Vec2 u) {
    const Bsdf& bsdf = seen.bsdf;
    if (u_lobe >= bsdf.opacity) return straight_sample(seen.outgoing, {1, 1, 1});
    // Given that the ray meets the surface, u_lobe is uniform below the opacity: stretched, it serves again.
    const float u_surface = std::min(u_lobe / bsdf.opacity, k_one_minus_epsilon);
    return std::visit(
        [&](const auto& surface) { return sample_surface(sampling, surface, seen, u_surface, u); },
        bsdf.surface);
}

Rgb eval_bsdf(const Bsdf& bsdf, Vec3 outgoing, Vec3 incoming) {
    return evaluate(see_bsdf(bsdf, outgoing), incoming).value;
}

float sample_bsdf_pdf(const Bsdf& bsdf, Vec3 outgoing, Vec3 incoming) {
    return evaluate(see_bsdf(bsdf, outgoing), incoming).pdf_solid_angle;
}

std::optional<BsdfSample> sample_bsdf(const Bsdf& bsdf, Vec3 outgoing, float u_lobe, Vec2 u) {
    return sample_direction(HemisphereSampling::bsdf, bsdf, outgoing, u_lobe, u);
}

std::optional<BsdfSample> sample_direction(HemisphereSampling sampling, const Bsdf& bsdf, Vec3 outgoing,
                                           float u_lobe, Vec2 u) {
    return sample_direction(sampling, see_bsdf(bsdf, outgoing), u_lobe, u);
}

float sample_direction_pdf(HemisphereSampling sampling, const Bsdf& bsdf, Vec3 outgoing, Vec3 incoming) {
    return eval_bsdf_and_pdf(sampling, bsdf, outgoing, incoming).pdf_solid_angle;
}

BsdfValue eval_bsdf_and_pdf(HemisphereSampling sampling, const Bsdf& bsdf, Vec3 outgoing, Vec3 incoming) {
    return eval_bsdf_and_pdf(sampling, see_bsdf(bsdf, outgoing), incoming);
}

Rgb straight_transmission(const Bsdf& bsdf, Vec3 outgoing) {
    const float open = 1 - bsdf.opacity;
    const ThinGlass* pane = std::get_if<ThinGlass>(&bsdf.surface);
    if (pane == nullptr) return {open, open, open};
    return Rgb{open, open, open} + pane_transmission(*pane, outgoing) * bsdf.opacity;
}

Rgb guide_albedo(const Bsdf& bsdf, Vec3 outgoing) {
    struct Colour {
        Vec3 outgoing;
        Rgb operator()(const Lambert& surface) const { return surface.albedo; }
        Rgb operator()(const StandardSurface& surface) const { return standard_albedo(surface, outgoing); }
        Rgb operator()(const Mirror& surface) const { return surface.tint; }
        Rgb operator()(const Dielectric& surface) const { return surface.tint; }
        Rgb operator()(const ThinGlass& surface) const { return surface.tint; }
    };
    return std::visit(Colour{outgoing}, bsdf.surface);
}

}  // namespace pathscope
