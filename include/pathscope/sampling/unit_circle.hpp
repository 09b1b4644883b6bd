#pragma once
/// Points of the unit circle: cosine and sine, and back to the angle, with the same bits on every machine.
///
/// Why: the image must not depend on which libm a server links or which variant of sinf that picks for its
/// processor. Sums, products and square roots are exact to the last bit by IEEE 754; sine and cosine are not,
/// so they are written out here: Taylor series up to x^9, of angles of at most an eighth of a turn. The series of the
/// arc tangent converges too slowly at 1; it is replaced by the polynomial up to x^15 of least relative error.
/// Units: turns (1 = 2 pi radians), because every caller has a uniform number in [0, 1).
/// Error: below 1.2e-7 in each coordinate; of angles, 4e-7 of the angle.   Test: tests/sampling/test_warp.cpp

#include <algorithm>
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

/// The angle at which a point of the upper half-plane lies, in turns from 0 to 1/2, wherever it is on its ray from the origin.
/// Requires: y >= 0; not both coordinates 0.
[[nodiscard]] inline float turns_of(Vec2 p) {
    const float x = std::abs(p.x), tangent = std::min(x, p.y) / std::max(x, p.y), t2 = tangent * tangent;
    constexpr float k_coefficients[] = {-7.469580741e-4f, 3.859889926e-3f, -9.467553347e-3f, 1.577908732e-2f,
                                        -2.231269702e-2f, 3.178280219e-2f, -5.304951221e-2f, 1.591549218e-1f};
    float sum = 0;
    for (const float coefficient : k_coefficients) sum = sum * t2 + coefficient;
    const float from_axis = sum * tangent;  // the nearer one
    const float from_x = x < p.y ? 0.25f - from_axis : from_axis;
    return p.x < 0 ? 0.5f - from_x : from_x;
}

}  // namespace pathscope
