#pragma once
/// An orthonormal, right-handed frame around a direction n: local z is n.
///
/// Local directions have cosθ = z, so that shading code never names the normal.
/// Source: Duff et al. 2017, "Building an Orthonormal Basis, Revisited", JCGT 6(1).
/// Test: tests/math/test_math.cpp

#include "pathscope/math/vec.hpp"

namespace pathscope {

struct Frame {
    Vec3 tangent, bitangent, normal;

    /// Requires: n of length one.
    [[nodiscard]] static Frame around(Vec3 n) {
        const float sign = std::copysign(1.0f, n.z);
        const float a = -1.0f / (sign + n.z);
        const float b = n.x * n.y * a;
        return {{1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
    }

    [[nodiscard]] Vec3 to_local(Vec3 world) const {
        return {dot(world, tangent), dot(world, bitangent), dot(world, normal)};
    }
    [[nodiscard]] Vec3 to_world(Vec3 local) const {
        return tangent * local.x + bitangent * local.y + normal * local.z;
    }
};

}  // namespace pathscope
