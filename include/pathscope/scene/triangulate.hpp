#pragma once
/// Ear clipping: a polygon to triangles whose areas add up to its own.
///
///   an ear is a corner whose triangle (before, corner, after) turns left and holds no other corner;
///   cut it off; a simple polygon of n corners gives n - 2 triangles this way
///
/// Why not a fan: where a polygon is not convex, a fan covers what lies outside of it.
/// A quad is cut along its shorter diagonal, if both allow it. Corners may repeat and lie on one line; a
/// polygon that crosses itself gives some n - 2 triangles. The turn is seen along the polygon's mean normal
/// (Newell), so faces that are slightly bent are fine.
///
/// Reference: Meisters 1975, "Polygons have ears". Cost: O(n r) for r corners that turn right.
///
/// Thread safety: yes.   Test: tests/scene/test_triangulate.cpp

#include <cstdint>
#include <span>
#include <vector>

#include "pathscope/math/vec.hpp"

namespace pathscope {

/// Twice the area of a polygon as a vector along its normal: the sum of cross products of a fan, which is right
/// for any polygon. In double, because faces may lie far from the origin.
struct PolygonNormal {
    double x = 0, y = 0, z = 0;
};
[[nodiscard]] PolygonNormal polygon_normal(std::span<const Vec3> corners);

/// Appends three corner numbers per triangle, in the polygon's winding. Requires: at least three corners.
void triangulate(std::span<const Vec3> corners, std::vector<std::uint32_t>& triangles);

}  // namespace pathscope
