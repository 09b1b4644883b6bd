#pragma once
/// The scene's surfaces: one indexed triangle mesh.
///
/// A triangle is three indices into `positions`; normals and texture coordinates, where a scene has them, lie at
/// the same index. `normals` and `uvs` are empty or as long as `positions`; a vertex with the normal (0, 0, 0) has
/// none, and the geometric normal takes its place there. `materials` is empty (all 0) or one id per triangle.
///
/// Convention: the geometric normal is on the side from which a, b, c run counter-clockwise.
/// Units: scene units; nothing here has an absolute tolerance, scenes differ by a factor of 100,000 in size.
/// Requires: validate() passed; the scene loader calls it, all other code relies on it.
/// Thread safety: values.   Test: tests/geometry/test_mesh.cpp

#include <cstddef>
#include <cstdint>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/geometry/double_vec.hpp"
#include "pathscope/math/box.hpp"
#include "pathscope/math/vec.hpp"

namespace pathscope {

/// Leaves room in 32 bits for the nodes of a tree over them.
inline constexpr std::size_t k_max_triangles = std::size_t{1} << 30;

struct TriangleIndices {
    std::uint32_t a = 0, b = 0, c = 0;

    friend bool operator==(const TriangleIndices&, const TriangleIndices&) = default;
};

struct Mesh {
    std::vector<Vec3> positions;
    std::vector<Vec3> normals;  ///< Empty or per vertex; (0, 0, 0) = none at this vertex.
    std::vector<Vec2> uvs;      ///< Empty or per vertex.
    std::vector<TriangleIndices> triangles;
    std::vector<std::uint32_t> materials;  ///< Empty (all 0) or per triangle.
    float longest_side = 0;  ///< Of the triangles' boxes, as longest_side(mesh) finds it; 0 = not measured.

    [[nodiscard]] std::uint32_t triangle_count() const {
        return static_cast<std::uint32_t>(triangles.size());
    }
    [[nodiscard]] std::uint32_t material_of(std::uint32_t triangle) const {
        return materials.empty() ? 0 : materials[triangle];
    }
};

struct TriangleCorners {
    Vec3 a, b, c;

    /// (1 - u - v) a + u b + v c
    [[nodiscard]] Vec3 at(float u, float v) const { return a * (1 - u - v) + b * u + c * v; }
};

[[nodiscard]] inline TriangleCorners corners(const Mesh& mesh, std::uint32_t triangle) {
    const TriangleIndices& i = mesh.triangles[triangle];
    return {mesh.positions[i.a], mesh.positions[i.b], mesh.positions[i.c]};
}

/// Twice the area times the normal. Exact zero for degenerate triangles: differences of floats are exact in double
/// (unless 2^29 apart in size), and so is the comparison of their products.
[[nodiscard]] inline DoubleVec area_vector(const TriangleCorners& t) {
    const DoubleVec p = to_double(t.b) - to_double(t.a);
    const DoubleVec q = to_double(t.c) - to_double(t.a);
    return {difference_of_products(p.y, q.z, p.z, q.y), difference_of_products(p.z, q.x, p.x, q.z),
            difference_of_products(p.x, q.y, p.y, q.x)};
}

/// True if the corners lie on one line or in one point: no area, no normal, never hit.
[[nodiscard]] inline bool is_degenerate(const TriangleCorners& triangle) {
    const DoubleVec n = area_vector(triangle);
    return n.x == 0 && n.y == 0 && n.z == 0;
}

/// Of length one; the zero vector for a degenerate triangle. Computed in double, so that slivers and scenes of
/// any size have one.
[[nodiscard]] inline Vec3 geometric_normal(const TriangleCorners& triangle) {
    const DoubleVec n = area_vector(triangle);
    const double size = length(n);
    if (size == 0) return {};
    return to_float(1 / size * n);
}

[[nodiscard]] inline float area(const TriangleCorners& triangle) {
    return float(0.5 * length(area_vector(triangle)));
}

[[nodiscard]] inline Box bounds(const TriangleCorners& triangle) {
    Box box;
    box.add(triangle.a);
    box.add(triangle.b);
    box.add(triangle.c);
    return box;
}

[[nodiscard]] inline float longest_side(const TriangleCorners& t) {
    return max_component(max(max(t.a, t.b), t.c) - min(min(t.a, t.b), t.c));
}

/// The largest of all triangles: so far can the triangle test be off (geometry/spawn.hpp).
[[nodiscard]] float longest_side(const Mesh& mesh);

/// Of all triangles; positions that no triangle uses do not count.
[[nodiscard]] Box bounds(const Mesh& mesh);

/// Checks the rules above, and that every number is finite. The sentence names the triangle or the vertex.
[[nodiscard]] Result<void> validate(const Mesh& mesh);

}  // namespace pathscope
