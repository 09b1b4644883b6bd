#pragma once
/// An axis-aligned box; empty until a point is added.

#include "pathscope/math/ray.hpp"
#include "pathscope/math/vec.hpp"

namespace pathscope {

struct Box {
    Vec3 low{k_infinity, k_infinity, k_infinity};
    Vec3 high{-k_infinity, -k_infinity, -k_infinity};

    void add(Vec3 point) {
        low = min(low, point);
        high = max(high, point);
    }
    void add(const Box& box) {
        low = min(low, box.low);
        high = max(high, box.high);
    }
    [[nodiscard]] bool empty() const { return low.x > high.x || low.y > high.y || low.z > high.z; }
    [[nodiscard]] Vec3 extent() const { return empty() ? Vec3{} : high - low; }
    [[nodiscard]] Vec3 centre() const { return (low + high) * 0.5f; }
    [[nodiscard]] float half_area() const {
        const Vec3 e = extent();
        return e.x * e.y + e.y * e.z + e.z * e.x;
    }
    [[nodiscard]] int longest_axis() const {
        const Vec3 e = extent();
        return e.x >= e.y && e.x >= e.z ? 0 : e.y >= e.z ? 1 : 2;
    }
};

}  // namespace pathscope
