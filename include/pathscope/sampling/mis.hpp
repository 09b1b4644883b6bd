#pragma once
/// Multiple importance sampling: how much to trust each of two ways to sample the same light.
///
///   L = f(x_a) w_a(x_a) / p_a(x_a) + f(x_b) w_b(x_b) / p_b(x_b)   is unbiased if w_a(x) + w_b(x) = 1
///
///   balance: w_a = p_a / (p_a + p_b)        power: w_a = p_a^2 / (p_a^2 + p_b^2)
///   off:     w_a = 1: there is no second way
///
/// Both pdfs must be in the same measure (pdf_solid_angle, or both pdf_area), with the sampling decision's
/// probability multiplied in. With `off` the caller must use one technique alone: uses_both_techniques() is
/// false, light sampling counts, and an emitter that a BSDF sample hits counts only after a specular vertex.
///
/// See: Veach & Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering".
/// Test: tests/sampling/test_mis.cpp

#include <array>
#include <cmath>
#include <cstdint>

#include "pathscope/core/enum_names.hpp"

namespace pathscope {

enum class MisHeuristic : std::uint8_t { off, balance, power };
inline constexpr std::array k_mis_names{
    EnumName<MisHeuristic>{MisHeuristic::off, "off"},
    EnumName<MisHeuristic>{MisHeuristic::balance, "balance"},
    EnumName<MisHeuristic>{MisHeuristic::power, "power"},
};
constexpr const auto& enum_table(MisHeuristic) { return k_mis_names; }

[[nodiscard]] constexpr bool uses_both_techniques(MisHeuristic heuristic) {
    return heuristic != MisHeuristic::off;
}

/// The weight of a sample drawn with density pdf_a that the other technique would draw with density pdf_b.
/// Requires: both >= 0; infinity stands for a delta. Ensures: in [0, 1]; 0 if pdf_a is 0.
[[nodiscard]] inline float mis_weight(MisHeuristic heuristic, float pdf_a, float pdf_b) {
    if (!(pdf_a > 0)) return 0;
    if (heuristic == MisHeuristic::off) return 1;
    if (std::isinf(pdf_a)) return std::isinf(pdf_b) ? 0.5f : 1.0f;
    // As a ratio, so that no square overflows or vanishes before its partner is known.
    const float ratio = pdf_b / pdf_a;
    return 1 / (1 + (heuristic == MisHeuristic::balance ? ratio : ratio * ratio));
}

}  // namespace pathscope
