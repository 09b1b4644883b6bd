#pragma once
/// Russian roulette: end a path early without biasing the image.
///
///   L' = L / q  with probability q,  0 otherwise   =>   E[L'] = q * (L / q) = L
///
/// Why: a path whose throughput is 0.01 costs as much as one at 1.0 and can add only 1 % of the light. `constant` is the
/// textbook's choice, one q for all paths; `throughput` takes the path's own throughput T as q, so that every survivor
/// carries about the same weight. Both spare the first bounces.
///
/// `efficiency` asks for the least variance times cost. What a path still finds is T R, at cost c; the pixel has variance
/// V and mean cost C. Ending the path adds T² E[R²] (1/q - 1) to V and saves (1 - q) c of C, so the product is least at
///
///   q = T sqrt(E[R²] / V · C / c)   (or 1)
///
/// The pixel of a dark surface has little variance: V is about in proportion to F², F the throughput after the first vertex.
/// And of a scene whose light bounces about, the rest of a path is a path like the whole one. So the root is 1/F times a number
/// of about the same size everywhere, somewhat above 1, which needs no pilot picture: k_efficiency_gain. With 2, a path goes
/// on unharmed while it carries half of what it did after its first vertex, and below that its survivors carry a half.
/// What it buys against `throughput` (Lambert, 8 bounces, relative variance times rays): a factor of 1.5 in the Sponza, whose
/// dark surfaces no longer send three bounces each, for three fifths of the rays at 1.1 times the relative variance; 1.05 in
/// the Cornell box, whose surfaces are bright.
/// Units: throughput is a ratio (radiance out / radiance in), so q is dimensionless.
/// See:   Arvo & Kirk 1990, "Particle Transport and Image Synthesis"; P_RR in Yan's GAMES101; Veach 1997, section 10.4,
///        and Rath et al. 2022, "EARS: Efficiency-Aware Russian Roulette and Splitting", who estimate what is constant here.
/// Thread safety: pure.
/// Test:  tests/integrator/test_russian_roulette.cpp     Lesson: lessons/06-russian-roulette

#include <algorithm>
#include <array>
#include <optional>

#include "pathscope/core/check.hpp"
#include "pathscope/core/enum_names.hpp"

namespace pathscope {

enum class Roulette { constant, throughput, efficiency };

constexpr std::array k_roulette_names{EnumName<Roulette>{Roulette::constant, "constant"},
                                      EnumName<Roulette>{Roulette::throughput, "throughput"},
                                      EnumName<Roulette>{Roulette::efficiency, "efficiency"}};
constexpr const auto& enum_table(Roulette) { return k_roulette_names; }

/// Survival by throughput, for `efficiency`.
inline constexpr float k_efficiency_gain = 2;

struct RouletteParams {
    Roulette kind = Roulette::efficiency;
    int first_bounce = 3;  ///< Bounces before this one always survive; of `efficiency`, where T / F allows.
    float constant_survival = 0.8f;  ///< q of `constant` (P_RR), in (0, 1].
    float max_survival =
        0.95f;  ///< Upper bound of q for the others: below 1, so that a path in a white box ends.

    friend bool operator==(const RouletteParams&, const RouletteParams&) = default;
};

/// What the roulette asks of a path: the largest channels of two of its throughputs.
struct PathStrength {
    float now = 1;    ///< T, >= 0.
    float first = 1;  ///< F: after the first vertex that is not specular, > 0; before it, 1.
};

/// q.
[[nodiscard]] inline float survival_probability(PathStrength path, int bounce, const RouletteParams& params) {
    const bool spared = bounce < params.first_bounce;
    if (params.kind == Roulette::efficiency)
        return std::min(k_efficiency_gain * path.now / path.first, spared ? 1.0f : params.max_survival);
    if (spared) return 1;
    return params.kind == Roulette::constant ? params.constant_survival
                                             : std::min(path.now, params.max_survival);
}

/// Returns the weight to multiply the throughput by, or nothing if the path ends here.
/// draw: gives a number uniform in [0, 1); it is asked only where there is a choice.
template <class Draw>
[[nodiscard]] std::optional<float> roulette_weight(PathStrength path, int bounce, Draw draw,
                                                   const RouletteParams& params = {}) {
    CHECK(path.now >= 0 && path.first > 0, path.now, path.first);
    const float survival = survival_probability(path, bounce, params);
    if (survival >= 1) return 1.0f;
    if (draw() >= survival) return std::nullopt;
    return 1.0f / survival;
}

}  // namespace pathscope
