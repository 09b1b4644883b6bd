#pragma once
/// The oracle of all trees, and rays of all kinds that have broken traversals.

#include <cmath>
#include <optional>

#include "geometry/test_meshes.hpp"
#include "pathscope/bvh/traverse.hpp"

namespace pathscope::testing {

/// The definition: all triangles one by one; the smallest t, and of equal ones the lowest number.
template <class Accept = AcceptAll>
[[nodiscard]] std::optional<Hit> brute_force(const Mesh& mesh, const Ray& ray, Accept&& accept = {}) {
    const TriangleRay triangle_ray(ray);
    std::optional<Hit> best;
    for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
        const TriangleCorners t = corners(mesh, i);
        const auto hit =
            intersect_triangle(triangle_ray, as_corner(t.a), as_corner(t.b), as_corner(t.c), ray.t_max);
        if (!hit || (best && hit->t >= best->t) || !accept(i, hit->u, hit->v)) continue;
        best = Hit{hit->t, hit->u, hit->v, i};
    }
    return best;
}

/// Rays of all kinds that have broken traversals: free, along axes (with zeros of both signs), in planes of axes, from
/// surfaces without an offset, through points of edges and through vertices.
class RayMaker {
  public:
    RayMaker(const Mesh& mesh, std::uint32_t seed) : mesh_(mesh), rng_(seed), scene_(bounds(mesh)) {
        const Vec3 margin = scene_.extent() * 0.25f;
        around_ = {scene_.low - margin, scene_.high + margin};
    }

    Ray next() {
        Ray ray = of_kind(kind_++ % 8);
        if (rng_.next_float() < 0.2f) limit(ray);
        return ray;
    }

  private:
    TriangleCorners some_triangle() { return corners(mesh_, rng_.next_u32() % mesh_.triangle_count()); }
    float sign() { return rng_.next_float() < 0.5f ? -1.0f : 1.0f; }
    Vec3 along_axis() {
        Vec3 direction{0.0f * sign(), 0.0f * sign(), 0.0f * sign()};
        direction[static_cast<int>(rng_.next_u32() % 3)] = sign();
        return direction;
    }
    Vec3 on_surface() { return some_triangle().at(rng_.next_float() * 0.5f, rng_.next_float() * 0.5f); }
    Ray towards(Vec3 target) {
        const Vec3 origin = random_point(rng_, around_);
        const Vec3 direction = target - origin;
        return {origin, rng_.next_float() < 0.5f && length(direction) > 0 ? normalize(direction) : direction};
    }

    Ray of_kind(int kind) {
        if (kind == 0) return {random_point(rng_, around_), random_direction(rng_)};
        if (kind == 1) return {random_point(rng_, around_), along_axis()};
        if (kind == 2) return {some_triangle().a, along_axis()};
        if (kind == 3) return {on_surface(), random_direction(rng_)};
        if (kind == 4) return towards(some_triangle().b);
        if (kind == 5) {
            const TriangleCorners t = some_triangle();
            return towards(lerp(t.a, t.b, rng_.next_float()));
        }
        if (kind == 6) {  // within a plane of two axes
            Ray ray{on_surface(), random_direction(rng_)};
            ray.direction[static_cast<int>(rng_.next_u32() % 3)] = 0.0f * sign();
            return ray;
        }
        return {some_triangle().a, some_triangle().b - some_triangle().c};  // from a vertex, along some edge
    }

    /// The interval begins or ends at a hit, or just beside one, or anywhere.
    void limit(Ray& ray) {
        const auto hit = brute_force(mesh_, ray);
        const float t = hit ? hit->t : length(scene_.extent());
        const int how = static_cast<int>(rng_.next_u32() % 5);
        if (how == 0) ray.t_max = t;
        if (how == 1) ray.t_max = std::nextafter(t, 0.0f);
        if (how == 2) ray.t_min = t;
        if (how == 3) ray.t_min = std::nextafter(t, k_infinity);
        if (how == 4) ray.t_max = t * 2 * rng_.next_float();
    }

    const Mesh& mesh_;
    HashRng rng_;
    Box scene_, around_;
    int kind_ = 0;
};

inline Mesh test_mesh(int number) {
    if (number == 0) return random_soup(700, 1);
    if (number == 1) return bumpy_sphere(3, 2);
    return box_interior(8);
}

inline bool is_zero_direction(const Ray& ray) { return is_zero(ray.direction); }

}  // namespace pathscope::testing
