#pragma once
/// Points of the unit circle: cosine and sine with the same bits on every machine.
///
/// Why: the image must not depend on which libm a server links or which variant of sinf that picks for its
/// processor. Sums, products and square roots are exact to the last bit by IEEE 754; sine and cosine are not,
/// so they are written out here: Taylor series up to x^9, of angles of at most an eighth of a turn.
/// Units: turns (1 = 2 pi radians), because every caller has a uniform number in [0, 1).
/// Error: below 1.2e-7 in each coordinate.   Test: tests/sampling/test_warp.cpp

#include <cmath>

#include "pathscope/math/vec.hpp"

namespace pathscope {

/// {cos x, sin x}. Requires: |radians| <= pi/4.
[[nodiscard]] constexpr Vec2 cos_sin_small(float radians) {
    const float x = radians, x2 = x * x;
    const float cosine = 1 - x2 * (1 / 2.0f - x2 * (1 / 24.0f - x2 * (1 / 720.0f - x2 * (1 / 40320.0f))));
    const float sine =
        x - x * x2 * (1 / 6.0f - x2 * (1 / 120.0f - x2 * (1 / 5040.0f - x2 * (1 / 362880.0f))));
    return {cosine, sine};
}

/// {cos, sin} of 2 pi turns. Requires: turns in [0, 1].
[[nodiscard]] constexpr Vec2 unit_circle(float turns) {
    const int quarter = int(4 * turns + 0.5f);  // the nearest of the four axes (4 is 0 again)
    const Vec2 p = cos_sin_small((4 * turns - float(quarter)) * (k_pi / 2));
    // Turned by quarters without a branch, which random numbers would make the processor guess wrong.
    const bool odd = quarter & 1;
    const float cosine = odd ? p.y : p.x, sine = odd ? p.x : p.y;
    return {(quarter + 1) & 2 ? -cosine : cosine, quarter & 2 ? -sine : sine};
}

}  // namespace pathscope
