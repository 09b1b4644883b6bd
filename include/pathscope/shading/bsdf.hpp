#pragma once
/// How a surface scatters light: a closed set of kinds behind one interface.
///
///   f(wo, wi) = dLo(wo) / (Li(wi) |cos wi| dwi)          weight = f |cos wi| / pdf
///
/// Convention: outgoing (towards the eye, where light leaves to) and incoming (where light comes from, where
/// the path goes on) both point away from the surface, in the local frame whose z is the shading normal, and
/// have length one. Values leave the cosine out. Densities are per solid angle of `incoming`.
///
/// Sides: Lambert and StandardSurface reflect where outgoing.z > 0 and incoming.z > 0 and are black
/// otherwise: the caller turns the frame so that outgoing.z > 0. A Dielectric has an inside, so its frame
/// stays as it is (has_inside() tells): z points out of the body, outgoing.z > 0 means seen from outside.
/// Mirror and ThinGlass work from either side.
///
/// Delta lobes (mirror, glass, the straight ray through a cut-out) have no finite value or density: eval and
/// pdf are zero for them, a sample of them says `specular`, and only its weight means anything. Light
/// sampling can never find them, MIS must not count them.
///
/// Opacity below 1: with probability 1 - opacity the ray passes straight through, weight 1, else it meets the
/// surface. So value and density both carry the factor `opacity`, and the weight does not.
///
/// Thread safety: values and pure functions; nothing allocates.
/// Test: tests/shading/test_bsdf.cpp, test_sampling.cpp, test_energy.cpp

#include <array>
#include <cstdint>
#include <optional>
#include <variant>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/math/vec.hpp"

namespace pathscope {

// ---- The kinds.

/// f = albedo / pi.
struct Lambert {
    Rgb albedo;
};

/// The Frostbite standard material (Lagarde & de Rousiers 2014); see shading/frostbite.hpp.
struct StandardSurface {
    Rgb diffuse;          ///< Albedo of the diffuse base, in [0, 1].
    Rgb f0;               ///< Specular reflectance at normal incidence, in [0, 1].
    float roughness = 1;  ///< Linear, in [0, 1]; alpha = roughness^2.
};

/// A perfect mirror that reflects `tint`.
struct Mirror {
    Rgb tint{1, 1, 1};
};

/// The smooth boundary of a transparent body.
struct Dielectric {
    float eta = 1.5f;   ///< Refractive index inside over outside.
    Rgb tint{1, 1, 1};  ///< Multiplies what is transmitted, at each crossing.
};

/// A pane: two parallel boundaries with all reflections between them summed. Light passes straight through.
struct ThinGlass {
    float eta = 1.5f;
    Rgb tint{1, 1, 1};  ///< Multiplies what is transmitted, once per pane.
};

using Surface = std::variant<Lambert, StandardSurface, Mirror, Dielectric, ThinGlass>;

struct Bsdf {
    Surface surface;
    float opacity = 1;  ///< In [0, 1].
};

/// Names of the kinds, in the order of Surface: for path tables and statistics.
enum class BsdfKind : std::uint8_t { lambert, standard, mirror, dielectric, thin_glass };
inline constexpr std::array k_bsdf_names{
    EnumName<BsdfKind>{BsdfKind::lambert, "lambert"},
    EnumName<BsdfKind>{BsdfKind::standard, "standard"},
    EnumName<BsdfKind>{BsdfKind::mirror, "mirror"},
    EnumName<BsdfKind>{BsdfKind::dielectric, "dielectric"},
    EnumName<BsdfKind>{BsdfKind::thin_glass, "thin_glass"},
};
constexpr const auto& enum_table(BsdfKind) { return k_bsdf_names; }

[[nodiscard]] inline BsdfKind bsdf_kind(const Bsdf& bsdf) { return BsdfKind(bsdf.surface.index()); }

/// True if all its light goes by delta lobes: there is nothing to connect to a light.
[[nodiscard]] bool is_specular(const Bsdf& bsdf);

/// True if the frame's z must stay the outward normal (Dielectric); for all others the caller turns z
/// towards `outgoing`.
[[nodiscard]] inline bool has_inside(const Bsdf& bsdf) {
    return std::holds_alternative<Dielectric>(bsdf.surface);
}

// ---- Value, density, sample.

/// The value without the cosine; zero for delta lobes.
[[nodiscard]] Rgb eval_bsdf(const Bsdf& bsdf, Vec3 outgoing, Vec3 incoming);

/// The density per solid angle with which sample_bsdf draws `incoming`; zero for delta lobes.
[[nodiscard]] float sample_bsdf_pdf(const Bsdf& bsdf, Vec3 outgoing, Vec3 incoming);

struct BsdfSample {
    Vec3 incoming;
    Rgb value;                  ///< f without the cosine; zero if specular.
    float pdf_solid_angle = 0;  ///< Zero if specular.
    Rgb weight;                 ///< f |cos| / pdf, or what a delta lobe's choice leaves.
    bool specular = false;      ///< A delta lobe.
    bool straight = false;      ///< The ray went on as if nothing were there, up to the weight: incoming ==
                                ///< -outgoing. Implies specular.
    float compression = 1;      ///< The part of the weight that is radiance squeezed by refraction, 1/eta^2.
                                ///< It comes back when the path leaves the body: roulette divides it out.
};

/// Draws `incoming`; nothing if the path ends here (absorbed, or no light can come from there).
/// u_lobe picks among delta, diffuse and specular lobes, u the direction. Requires: all in [0, 1).
[[nodiscard]] std::optional<BsdfSample> sample_bsdf(const Bsdf& bsdf, Vec3 outgoing, float u_lobe, Vec2 u);

// ---- The lever: how directions of the hemisphere are drawn.

/// uniform is the textbook (pdf = 1/2pi), bsdf the best. All three converge to the same image; delta lobes
/// are sampled as deltas under each.
enum class HemisphereSampling : std::uint8_t { uniform, cosine, bsdf };
inline constexpr std::array k_hemisphere_names{
    EnumName<HemisphereSampling>{HemisphereSampling::uniform, "uniform"},
    EnumName<HemisphereSampling>{HemisphereSampling::cosine, "cosine"},
    EnumName<HemisphereSampling>{HemisphereSampling::bsdf, "bsdf"},
};
constexpr const auto& enum_table(HemisphereSampling) { return k_hemisphere_names; }

[[nodiscard]] std::optional<BsdfSample> sample_direction(HemisphereSampling sampling, const Bsdf& bsdf,
                                                         Vec3 outgoing, float u_lobe, Vec2 u);
[[nodiscard]] float sample_direction_pdf(HemisphereSampling sampling, const Bsdf& bsdf, Vec3 outgoing,
                                         Vec3 incoming);

/// Value and density at once, for a light sample under MIS: the same bits as eval_bsdf and
/// sample_direction_pdf, with the work they share done once.
struct BsdfValue {
    Rgb value;
    float pdf_solid_angle = 0;
};
[[nodiscard]] BsdfValue eval_bsdf_and_pdf(HemisphereSampling sampling, const Bsdf& bsdf, Vec3 outgoing,
                                          Vec3 incoming);

// ---- Summaries.

/// The share of light that passes straight through, in expectation: 1 - opacity, and the pane's transmission.
/// A shadow ray may multiply by it and go on; then a path that passed `straight` must be treated as if it had
/// not met this surface at all, else that light counts twice.
[[nodiscard]] Rgb straight_transmission(const Bsdf& bsdf, Vec3 outgoing);

/// Colour of the surface as seen along `outgoing`: its directional albedo from a table, good to about 0.02.
/// For filter guides and albedo buffers. Delta kinds: the tint.
[[nodiscard]] Rgb guide_albedo(const Bsdf& bsdf, Vec3 outgoing);

}  // namespace pathscope
