#pragma once
/// The directional albedo of a surface, integrated by brute force: how white is it, seen from there?
///
///   E(wo) = ∫ f(wo, wi) cos_i dwi       the share of light that a surface in a white furnace sends to wo
///
/// Energy conservation is E <= 1; what is missing is absorbed, or lost by the model. Delta lobes have no
/// finite value and are left out. Knows nothing of how directions are sampled, so it can judge that.
/// Test: tests/shading/test_energy.cpp

#include "pathscope/math/vec.hpp"
#include "pathscope/shading/bsdf.hpp"

namespace pathscope {

/// Midpoints in polar coordinates about the mirror direction, where rough and smooth lobes alike have their
/// peak, with steps that shrink towards it: steps^2 evaluations, error about 0.002 at 256 steps.
/// Requires: outgoing.z > 0.
[[nodiscard]] Rgb directional_albedo(const Bsdf& bsdf, Vec3 outgoing, int steps = 256);

}  // namespace pathscope
