#pragma once
/// Three doubles: what the once-per-hit computations are done in, so that their floats are rounded once.

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

}  // namespace pathscope
