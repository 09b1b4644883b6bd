#pragma once
/// The levers of light transport, each by name, and the two settings that pull them all.
///
///   textbook: the estimator of Yan's GAMES101 and of Huang's "A Distributed Path Tracer": light uniform by area,
///             hemisphere uniform, constant roulette, independent random numbers, no MIS.
///   best:     light by a tree where there are many, else by power, one or two samples of it per vertex, BRDF sampling, MIS by
///             the power heuristic, roulette by efficiency, Owen-scrambled Sobol.
///
/// Why: both converge to the same image, so a lesson can ask what each lever buys.
/// Thread safety: values.   Test: tests/integrator/test_settings.cpp

#include <array>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/integrator/russian_roulette.hpp"
#include "pathscope/sampling/mis.hpp"
#include "pathscope/sampling/sampler.hpp"
#include "pathscope/scene/lights.hpp"
#include "pathscope/shading/bsdf.hpp"

namespace pathscope {

enum class Setting { best, textbook };

constexpr std::array k_setting_names{EnumName<Setting>{Setting::best, "best"},
                                     EnumName<Setting>{Setting::textbook, "textbook"}};
constexpr const auto& enum_table(Setting) { return k_setting_names; }

/// One light sample per vertex where there is one light to pick, else two: by one alone, sun and sky, or two lamps, are picked by
/// chance, while a second sample of the same lamp costs a ray and adds little.
inline constexpr int k_auto_light_samples = 0;
inline constexpr int k_max_light_samples = 64;

struct TransportSettings {
    LightSampling light = LightSampling::tree;
    int light_samples = k_auto_light_samples;  ///< Per vertex.
    HemisphereSampling hemisphere = HemisphereSampling::bsdf;
    MisHeuristic mis = MisHeuristic::power;
    SamplerKind sampler = SamplerKind::sobol;
    RouletteParams roulette;
    int max_bounces = 0;  ///< Light that scattered more often is left out; 0 = no limit.

    friend bool operator==(const TransportSettings&, const TransportSettings&) = default;
};

[[nodiscard]] constexpr TransportSettings make_settings(Setting setting) {
    TransportSettings settings;
    if (setting == Setting::textbook) {
        settings.light = LightSampling::area;
        settings.light_samples = 1;
        settings.hemisphere = HemisphereSampling::uniform;
        settings.mis = MisHeuristic::off;
        settings.sampler = SamplerKind::independent;
        settings.roulette.kind = Roulette::constant;
        settings.roulette.first_bounce = 0;
    }
    return settings;
}

}  // namespace pathscope
