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

/// Midpoints in polar coordinates of the half vector, in which each lobe of microfacets is round however flat
/// the view, with steps that shrink towards the normal: steps^2 evaluations, error below 0.001 at 96 steps.
/// Requires: outgoing.z > 0.
[[nodiscard]] Rgb directional_albedo(const Bsdf& bsdf, Vec3 outgoing, int steps = 256);

}  // namespace pathscope
