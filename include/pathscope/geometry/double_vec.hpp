#pragma once
/// Three doubles: what the once-per-hit computations are done in, so that their floats are rounded once.
///
/// Thread safety: values.   Test: tests/geometry/test_triangle.cpp

#include <cmath>

#include "pathscope/math/vec.hpp"

namespace pathscope {

struct DoubleVec {
    double x, y, z;

    friend DoubleVec operator+(DoubleVec a, DoubleVec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend DoubleVec operator-(DoubleVec a, DoubleVec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend DoubleVec operator*(double s, DoubleVec a) { return {s * a.x, s * a.y, s * a.z}; }
};

[[nodiscard]] inline DoubleVec to_double(Vec3 v) { return {v.x, v.y, v.z}; }
[[nodiscard]] inline Vec3 to_float(DoubleVec v) { return {float(v.x), float(v.y), float(v.z)}; }
[[nodiscard]] inline double dot(DoubleVec a, DoubleVec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
[[nodiscard]] inline double length(DoubleVec v) { return std::sqrt(dot(v, v)); }

/// a b - c d with the exact sign: zero only where it is zero in real numbers. Its zero is +0.
/// Requires: no product so small that it vanishes; those of differences of floats never are.
[[nodiscard]] inline double difference_of_products(double a, double b, double c, double d) {
    const double ab = a * b;
    const double cd = c * d;
    // Equal products are most often both zero: edges along the axes, which need no closer look.
    if ((ab == cd) & (ab != 0)) [[unlikely]]
        return std::fma(a, b, -ab) - std::fma(c, d, -cd);
    return ab - cd + 0.0;  // Makes -0 +0.
}

}  // namespace pathscope
