#pragma once
/// Directions and surfaces that the tests of shading share.

#include <cmath>
#include <string>
#include <vector>

#include "pathscope/math/random.hpp"
#include "pathscope/shading/bsdf.hpp"

namespace pathscope::testing {

inline Vec3 direction_at(float cosine, float turns = 0.1f) {
    const float sine = std::sqrt(1 - cosine * cosine);
    return {sine * std::cos(2 * k_pi * turns), sine * std::sin(2 * k_pi * turns), cosine};
}

inline Vec2 next_2d(HashRng& rng) {
    const float x = rng.next_float();
    return {x, rng.next_float()};
}

inline Bsdf standard(Rgb diffuse, Rgb f0, float roughness) {
    return {StandardSurface{diffuse, f0, roughness}, 1};
}

/// Surfaces without delta lobes: both lobes, each alone, coloured, and more than what is physical.
inline std::vector<Bsdf> smooth_surfaces() {
    return {
        Bsdf{Lambert{{0.8f, 0.5f, 0.1f}}, 1},
        standard({0.8f, 0.5f, 0.1f}, {0.04f, 0.04f, 0.04f}, 0.3f),
        standard({0.5f, 0.5f, 0.5f}, {0.04f, 0.04f, 0.04f}, 0.8f),
        standard({0, 0, 0}, {1, 0.8f, 0.3f}, 0.2f),
        standard({0, 0, 0}, {0.9f, 0.9f, 0.9f}, 1),
        standard({0.7f, 0.6f, 0.5f}, {0, 0, 0}, 0.5f),
        standard({1, 1, 1}, {0.8f, 0.2f, 0.5f}, 0.5f),
        standard({0.2f, 0.2f, 0.9f}, {0.001f, 0.001f, 0.001f}, 0.6f),
    };
}

inline std::vector<Bsdf> delta_surfaces() {
    return {
        Bsdf{Mirror{{0.9f, 0.8f, 0.7f}}, 1},
        Bsdf{Dielectric{1.5f, {1, 1, 1}}, 1},
        Bsdf{Dielectric{1.33f, {0.5f, 0.9f, 1}}, 1},
        Bsdf{ThinGlass{1.5f, {0.9f, 1, 0.9f}}, 1},
    };
}

}  // namespace pathscope::testing
