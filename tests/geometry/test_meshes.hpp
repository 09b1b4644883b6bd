#pragma once
/// Meshes for the tests of geometry and bvh, made by arithmetic, all about one unit in size.

#include <map>
#include <utility>

#include "pathscope/geometry/mesh.hpp"
#include "pathscope/math/random.hpp"

namespace pathscope::testing {

inline Vec3 random_point(HashRng& rng, const Box& box) {
    const Vec3 u{rng.next_float(), rng.next_float(), rng.next_float()};
    return box.low + box.extent() * u;
}

inline Vec3 random_direction(HashRng& rng) {
    for (;;) {
        const Vec3 v = random_point(rng, {{-1, -1, -1}, {1, 1, 1}});
        if (length_squared(v) <= 1 && length_squared(v) > 1e-4f) return normalize(v);
    }
}

/// Triangles of many sizes at random places, none of which share a vertex.
inline Mesh random_soup(int count, std::uint32_t seed) {
    HashRng rng(seed);
    Mesh mesh;
    for (int i = 0; i < count; ++i) {
        const Vec3 middle = random_point(rng, {{0, 0, 0}, {1, 1, 1}});
        const float size = 0.5f * rng.next_float() * rng.next_float();
        for (int k = 0; k < 3; ++k) mesh.positions.push_back(middle + random_direction(rng) * size);
        const auto first = static_cast<std::uint32_t>(3 * i);
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

/// A closed surface around the origin, visible from there as a whole: an octahedron, divided `levels` times, whose
/// vertices lie at random distances of 0.8 to 1. Neighbours share vertices.
inline Mesh bumpy_sphere(int levels, std::uint32_t seed) {
    Mesh mesh;
    mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int level = 0; level < levels; ++level) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [place, is_new] =
                middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.positions.size()));
            if (is_new) mesh.positions.push_back(normalize(mesh.positions[a] + mesh.positions[b]));
            return place->second;
        };
        std::vector<TriangleIndices> finer;
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        mesh.triangles = std::move(finer);
    }
    HashRng rng(seed);
    for (Vec3& position : mesh.positions) position *= 0.8f + 0.2f * rng.next_float();
    return mesh;
}

/// A grid of n x n quads, two triangles each, from `corner` along two edges.
inline void add_quad(Mesh& mesh, Vec3 corner, Vec3 edge_u, Vec3 edge_v, int n = 1) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const auto row = static_cast<std::uint32_t>(n + 1);
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i)
            mesh.positions.push_back(corner + edge_u * (float(i) / float(n)) +
                                     edge_v * (float(j) / float(n)));
    for (std::uint32_t j = 0; j + 1 < row; ++j)
        for (std::uint32_t i = 0; i + 1 < row; ++i) {
            const std::uint32_t a = first + j * row + i;
            mesh.triangles.push_back({a, a + 1, a + row + 1});
            mesh.triangles.push_back({a, a + row + 1, a + row});
        }
}

/// The walls of the unit cube with a block on its floor. All faces lie along axes, so that their boxes are flat. Hard
/// cases are mixed in: coincident copies (the same, turned, flipped, of another diagonal), the block's bottom in the
/// plane of the floor, and degenerate triangles.
inline Mesh box_interior(int n) {
    Mesh mesh;
    const Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
    add_quad(mesh, {0, 0, 0}, x, z, n);
    add_quad(mesh, {0, 1, 0}, z, x, n);
    add_quad(mesh, {0, 0, 0}, z, y, n);
    add_quad(mesh, {1, 0, 0}, y, z, n);
    add_quad(mesh, {0, 0, 0}, y, x, n);
    add_quad(mesh, {0, 0, 1}, x, y, n);

    const Vec3 corner{0.25f, 0, 0.25f};
    for (const float height : {0.0f, 0.5f}) add_quad(mesh, corner + y * height, x * 0.5f, z * 0.5f);
    add_quad(mesh, corner, x * 0.5f, y * 0.5f);
    add_quad(mesh, corner, z * 0.5f, y * 0.5f);
    add_quad(mesh, corner + x * 0.5f, z * 0.5f, y * 0.5f);
    add_quad(mesh, corner + x * 0.5f, z * 0.5f, y * 0.5f);              // the same once more
    add_quad(mesh, corner + z * 0.5f, x * 0.5f, y * 0.5f);              // and the next one
    add_quad(mesh, corner + Vec3{0.5f, 0, 0.5f}, x * -0.5f, y * 0.5f);  // with the other diagonal

    for (std::uint32_t i = 0; i < 20; ++i) {
        const TriangleIndices t = mesh.triangles[i * 7];
        mesh.triangles.push_back({t.b, t.c, t.a});
        mesh.triangles.push_back({t.b, t.a, t.c});
        mesh.triangles.push_back({t.a, t.b, t.b});
        mesh.triangles.push_back({t.a, t.a, t.a});
    }
    return mesh;
}

/// Rounded to float per vertex, as a file that was written in these units would be.
inline Mesh scaled_and_moved(Mesh mesh, float scale, Vec3 offset) {
    for (Vec3& position : mesh.positions) position = position * scale + offset;
    return mesh;
}

}  // namespace pathscope::testing
