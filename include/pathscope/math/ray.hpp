#pragma once
/// A ray: the points origin + t * direction for t in [t_min, t_max].
///
/// direction need not have length one for intersection; the renderer's rays have it. t_max shrinks as hits
/// are found.

#include <limits>

#include "pathscope/math/vec.hpp"

namespace pathscope {

inline constexpr float k_infinity = std::numeric_limits<float>::infinity();

struct Ray {
    Vec3 origin;
    Vec3 direction;
    float t_min = 0;
    float t_max = k_infinity;

    [[nodiscard]] Vec3 at(float t) const { return origin + direction * t; }
};

}  // namespace pathscope
