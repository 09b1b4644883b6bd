#pragma once
/// Shapes to build a house from: boxes, turned columns, arches, vaults, mouldings, curved sheets.
///
/// A shape is an indexed triangle mesh with a normal and a uv at each vertex. Edges that should look sharp
/// have two vertices, so nothing has to be guessed from angles later.
/// Units: metres, and uv in metres along the surface too, so that one texture fits all shapes of a material.
/// Convention: right-handed, y up; triangles run counter-clockwise seen from outside.
/// Thread safety: values.

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "pathscope/math/vec.hpp"

namespace pathscope::atrium {

struct Vertex {
    Vec3 position, normal;
    Vec2 uv;
};

struct Shape {
    std::vector<Vertex> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Where a shape stands: scaled, then turned about the y axis (radians, from z towards x), then moved.
struct Placement {
    Vec3 origin{};
    float turn = 0;
    Vec3 scale{1, 1, 1};
};

[[nodiscard]] Vec3 turned(Vec3 v, float angle);
void append(Shape& to, const Shape& shape, const Placement& place = {});

/// A flat convex polygon that faces `normal`, whichever way its corners run; uv by projection along the axis
/// the normal is nearest to.
void add_polygon(Shape& to, const std::vector<Vec3>& corners, Vec3 normal);

/// A sheet P(u, v) over [0, 1]^2 whose normal is dP/du x dP/dv; uv = (u, v) * uv_size.
/// Requires: the two derivatives are nowhere parallel.
[[nodiscard]] Shape sheet(int columns, int rows, Vec2 uv_size,
                          const std::function<Vec3(float, float)>& point);

/// A box with edges cut off at 45 degrees: real edges catch the light.
[[nodiscard]] Shape box(Vec3 low, Vec3 high, float bevel = 0);

/// The outline of something turned about the y axis, from bottom to top. Where it bends by more than 30
/// degrees there is a sharp edge.
struct ProfilePoint {
    float radius, height;
};
[[nodiscard]] Shape lathe(const std::vector<ProfilePoint>& profile, int segments);
[[nodiscard]] Shape ball(float radius, int segments);

/// A wall over one arch: as wide as the bay, from the spring line (y = 0) up, with a half circle cut out. It
/// stands in the xy plane, `depth` thick, the opening's centre at the origin.
struct ArchSize {
    float width, height, radius, depth;
};
[[nodiscard]] Shape arch_wall(const ArchSize& size, int segments);

/// A profile (distance from the arch's edge, distance from the wall) led along the half circle.
[[nodiscard]] Shape arch_moulding(float radius, const std::vector<Vec2>& profile, int segments);

/// A profile (distance inwards, height) led round the inside of a rectangle with mitred corners.
[[nodiscard]] Shape inner_moulding(float half_x, float half_z, const std::vector<Vec2>& profile);

/// A groin vault: two barrels that cross, over a bay of size_x by size_z, springing at y = 0.
///   y = rise sqrt(1 - min(s, t)^2),  s = 2|x| / size_x,  t = 2|z| / size_z
[[nodiscard]] Shape groin_vault(float size_x, float size_z, float rise, int segments);

/// A quad for a cut-out leaf or cloth, uv from (0, 0) to (1, 1); `right` and `up` reach from edge to edge.
void add_card(Shape& to, Vec3 centre, Vec3 right, Vec3 up);

/// A pipe along a closed curve P(t), t in [0, 1].
[[nodiscard]] Shape closed_tube(const std::function<Vec3(float)>& curve, float radius, int steps,
                                int segments);

}  // namespace pathscope::atrium
