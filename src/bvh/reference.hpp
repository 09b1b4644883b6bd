#pragma once
/// What the builder of the wide tree sorts: references to triangles, each with the box of the part of the triangle that it
/// stands for.

#include <cstdint>
#include <vector>

#include "pathscope/geometry/mesh.hpp"
#include "pathscope/math/box.hpp"
#include "pathscope/math/simd.hpp"

namespace pathscope {

/// 32 bytes, two registers; the fourth lane of the first carries the triangle.
struct alignas(16) Reference {
    Vec3 low;
    std::uint32_t triangle = 0;
    Vec3 high;
    std::uint32_t unused = 0;

    [[nodiscard]] Box box() const { return {low, high}; }
};

/// A box in two registers.
struct WideBox {
    Float4 low = broadcast4(k_infinity), high = broadcast4(-k_infinity);

    void add(const WideBox& box) {
        low = min(box.low, low);
        high = max(box.high, high);
    }
    void add(Float4 point) {
        low = min(point, low);
        high = max(point, high);
    }
    [[nodiscard]] Box box() const {
        alignas(16) float a[4], b[4];
        store(a, low);
        store(b, high);
        return {{a[0], a[1], a[2]}, {b[0], b[1], b[2]}};
    }
    [[nodiscard]] bool empty() const { return box().empty(); }
    /// 0 for an empty one.
    [[nodiscard]] float half_area() const { return box().half_area(); }
};

[[nodiscard]] inline WideBox box_of(const Reference& reference) {
    return {first_three(load4(&reference.low.x)), load4(&reference.high.x)};
}

/// Boxes and, doubled, their centres, of a set of references.
struct ReferenceBounds {
    WideBox boxes, centroids;
};

template <class References>
[[nodiscard]] ReferenceBounds bounds_of(const References& references) {
    ReferenceBounds bounds;
    for (const Reference& reference : references) {
        const WideBox box = box_of(reference);
        bounds.boxes.add(box);
        bounds.centroids.add(box.low + box.high);
    }
    return bounds;
}

}  // namespace pathscope
