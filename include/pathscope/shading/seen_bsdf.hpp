#pragma once
/// A BSDF as seen along one direction: what depends on that direction alone is worked out once.
///
///   f(wo, wi),  pdf(wi | wo),  wi ~ pdf( . | wo)        for one wo and any number of wi
///
/// Why: a path's vertex asks along the same outgoing direction for each of its light samples and for its next direction.
/// Of the standard material the half of each answer is a matter of `outgoing` alone: albedos, roots and fractions.
///
/// Convention, Units, Requires: as bsdf.hpp, whose functions are these for a single question.
/// Thread safety: a value and pure functions.   Test: tests/shading/test_bsdf.cpp

#include <optional>

#include "pathscope/shading/bsdf.hpp"
#include "pathscope/shading/frostbite.hpp"

namespace pathscope {

struct SeenBsdf {
    Bsdf bsdf;
    Vec3 outgoing;
    std::optional<StandardView> standard;  ///< Of a StandardSurface seen from above: it reflects.
};

/// Works out what depends on `outgoing`.
inline void look(SeenBsdf& seen) {
    const auto* surface = std::get_if<StandardSurface>(&seen.bsdf.surface);
    if (surface != nullptr && seen.outgoing.z > 0) seen.standard.emplace(*surface, seen.outgoing);
}

[[nodiscard]] inline SeenBsdf see_bsdf(const Bsdf& bsdf, Vec3 outgoing) {
    SeenBsdf seen{bsdf, outgoing, {}};
    look(seen);
    return seen;
}

/// As eval_bsdf_and_pdf() of bsdf.hpp.
[[nodiscard]] BsdfValue eval_bsdf_and_pdf(HemisphereSampling sampling, const SeenBsdf& seen, Vec3 incoming);

/// As sample_direction() of bsdf.hpp.
[[nodiscard]] std::optional<BsdfSample> sample_direction(HemisphereSampling sampling, const SeenBsdf& seen,
                                                         float u_lobe, Vec2 u);

}  // namespace pathscope
