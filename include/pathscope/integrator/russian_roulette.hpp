#pragma once
/// Russian roulette: end a path early without biasing the image.
///
///   L' = L / q  with probability q,  0 otherwise   =>   E[L'] = q * (L / q) = L
///
/// Why: a path whose throughput is 0.01 costs as much as one at 1.0 and can add only 1 % of the light. `constant` is the
/// textbook's choice, one q for all paths; `throughput` takes the path's own throughput as q, so that every survivor
/// carries about the same weight.
/// Units: throughput is a ratio (radiance out / radiance in), so q is dimensionless.
/// See:   Arvo & Kirk 1990, "Particle Transport and Image Synthesis"; P_RR in Yan's GAMES101.
/// Thread safety: pure.
/// Test:  tests/integrator/test_russian_roulette.cpp     Lesson: lessons/06-russian-roulette

#include <algorithm>
#include <array>
#include <optional>

#include "pathscope/core/check.hpp"
#include "pathscope/core/enum_names.hpp"

namespace pathscope {

enum class Roulette { constant, throughput };

constexpr std::array k_roulette_names{EnumName<Roulette>{Roulette::constant, "constant"},
                                      EnumName<Roulette>{Roulette::throughput, "throughput"}};
constexpr const auto& enum_table(Roulette) { return k_roulette_names; }

struct RouletteParams {
    Roulette kind = Roulette::throughput;
    int first_bounce = 3;            ///< Bounces before this one always survive.
    float constant_survival = 0.8f;  ///< q of `constant` (P_RR), in (0, 1].
    float max_survival =
        0.95f;  ///< Upper bound of q for `throughput`: below 1, so that a path in a white box ends.

    friend bool operator==(const RouletteParams&, const RouletteParams&) = default;
};

/// Returns the weight to multiply the throughput by, or nothing if the path ends here.
/// Requires: max_throughput >= 0 (largest channel); u uniform in [0, 1).
[[nodiscard]] inline std::optional<float> roulette_weight(float max_throughput, int bounce, float u,
                                                          const RouletteParams& params = {}) {
    CHECK(max_throughput >= 0, max_throughput);
    if (bounce < params.first_bounce) return 1.0f;
    const float survival = params.kind == Roulette::constant ? params.constant_survival
                                                             : std::min(max_throughput, params.max_survival);
    if (u >= survival) return std::nullopt;
    return 1.0f / survival;
}

}  // namespace pathscope
