#pragma once
/// What the builder sorts: boxes of triangles, and consecutive ranges of them.

#include <cstdint>
#include <span>

#include "pathscope/math/box.hpp"

namespace pathscope {

struct BuildTriangle {
    Box box;
    std::uint32_t triangle;

    /// Twice the centre of the box; the factor does not change an order.
    [[nodiscard]] Vec3 centroid() const { return box.low + box.high; }
};

using BuildRange = std::span<BuildTriangle>;

struct RangeBounds {
    Box boxes, centroids;
};

[[nodiscard]] inline RangeBounds range_bounds(std::span<const BuildTriangle> range) {
    RangeBounds bounds;
    for (const BuildTriangle& triangle : range) {
        bounds.boxes.add(triangle.box);
        bounds.centroids.add(triangle.centroid());
    }
    return bounds;
}

}  // namespace pathscope
