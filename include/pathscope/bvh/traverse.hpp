#pragma once
/// Which triangle does a ray meet first, and does it meet any?
///
/// The walk goes down the tree to the nearer child first, and keeps the farther ones on a stack; once a hit is known,
/// whatever begins behind it is skipped. No recursion, no allocation, no virtual call.
///
///     std::optional<Hit> hit = closest_hit(bvh, ray);
///     bool dark = any_hit(bvh, shadow_ray, [&](uint32_t triangle, float u, float v) { return opaque(triangle, u, v); });
///
/// accept(triangle, u, v) -> bool tells whether a hit counts: a cut-out returns false in its holes. It must be pure,
/// because how often and in which order it is asked depends on the tree.
///
/// Ensures: the answer depends on mesh and ray only, not on the tree: it is that of testing all triangles one by one,
/// bit for bit. Of several triangles hit at the same t (coincident copies, shared edges) the one with the lowest
/// number counts.
/// Requires: a finite origin; a finite direction that is not zero, of any length. An empty interval (t_max < t_min)
/// meets nothing.
/// Thread safety: pure, as far as accept and probe are.
/// Test: tests/bvh/test_traverse.cpp (against brute force)

#include <cstdint>
#include <optional>

#include "pathscope/bvh/box_ray.hpp"
#include "pathscope/bvh/bvh.hpp"
#include "pathscope/bvh/traversal_probe.hpp"
#include "pathscope/geometry/hit.hpp"
#include "pathscope/geometry/triangle.hpp"

namespace pathscope {

struct AcceptAll {
    bool operator()(std::uint32_t /*triangle*/, float /*u*/, float /*v*/) const { return true; }
};

namespace detail {

/// Nodes that wait for their turn. One per level at most, so k_bvh_max_depth of them suffice.
class TraversalStack {
  public:
    void push(std::uint32_t node, float t_near) { entries_[size_++] = {node, t_near}; }

    /// The next node that begins before t_max; nothing if there is none left.
    template <class Probe>
    [[nodiscard]] std::optional<std::uint32_t> pop(float t_max, Probe& probe) {
        while (size_ > 0) {
            const auto [node, t_near] = entries_[--size_];
            if (t_near <= t_max) return node;
            probe.drop_node(node, t_near);
        }
        return std::nullopt;
    }

  private:
    struct Entry {
        std::uint32_t node;
        float t_near;
    };
    int size_ = 0;
    Entry entries_[k_bvh_max_depth];
};

/// Calls open_leaf(leaf) for the leaves that the ray meets before t_max, nearer ones first (as far as boxes tell);
/// open_leaf may lower t_max, and ends the walk by returning true.
template <class OpenLeaf, class Probe>
void walk(const Bvh& bvh, const Ray& ray, const float& t_max, OpenLeaf&& open_leaf, Probe& probe) {
    if (bvh.empty()) return;
    const BoxRay box_ray(ray, bvh.bounds());
    const auto test_box = [&](std::uint32_t node) {
        const BoxInterval interval = intersect_box(box_ray, bvh.node(node).bounds, ray.t_min, t_max);
        probe.test_box(node, interval.t_near, interval.met());
        return interval;
    };

    TraversalStack stack;
    std::optional<std::uint32_t> current;
    if (test_box(0).met()) current = 0;
    while (current) {
        probe.enter_node(*current);
        const BvhNode& node = bvh.node(*current);
        if (node.is_leaf()) {
            if (open_leaf(node)) return;
            current = stack.pop(t_max, probe);
            continue;
        }
        const std::uint32_t left = node.first, right = node.first + 1;
        const BoxInterval in_left = test_box(left), in_right = test_box(right);
        if (in_left.met() && in_right.met()) {
            const bool left_first = in_left.t_near <= in_right.t_near;
            const std::uint32_t farther = left_first ? right : left;
            const float t_farther = left_first ? in_right.t_near : in_left.t_near;
            probe.postpone_node(farther, t_farther);
            stack.push(farther, t_farther);
            current = left_first ? left : right;
        } else if (in_left.met() || in_right.met()) {
            current = in_left.met() ? left : right;
        } else {
            current = stack.pop(t_max, probe);
        }
    }
}

}  // namespace detail

template <class Accept, class Probe>
[[nodiscard]] std::optional<Hit> closest_hit(const Bvh& bvh, const Ray& ray, Accept&& accept, Probe& probe) {
    const TriangleRay triangle_ray(ray);
    Hit best{.t = ray.t_max};
    bool found = false;
    const auto test = [&](const LeafTriangle& leaf) {
        const auto hit = intersect_triangle(triangle_ray, leaf.a, leaf.b, leaf.c, best.t);
        if (!hit) return TriangleOutcome::missed;
        if (found && hit->t == best.t && leaf.triangle > best.triangle) return TriangleOutcome::tied;
        if (!accept(leaf.triangle, hit->u, hit->v)) return TriangleOutcome::rejected;
        best = {hit->t, hit->u, hit->v, leaf.triangle};
        found = true;
        return TriangleOutcome::closest;
    };
    const auto open_leaf = [&](const BvhNode& node) {
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
            const TriangleOutcome outcome = test(bvh.triangles[i]);
            probe.test_triangle(bvh.triangles[i].triangle, outcome, best.t);
        }
        return false;
    };
    detail::walk(bvh, ray, best.t, open_leaf, probe);
    return found ? std::optional(best) : std::nullopt;
}

template <class Accept, class Probe>
[[nodiscard]] bool any_hit(const Bvh& bvh, const Ray& ray, Accept&& accept, Probe& probe) {
    const TriangleRay triangle_ray(ray);
    bool found = false;
    const auto open_leaf = [&](const BvhNode& node) {
        for (std::uint32_t i = node.first; i < node.first + node.count && !found; ++i) {
            const LeafTriangle& leaf = bvh.triangles[i];
            const auto hit = intersect_triangle(triangle_ray, leaf.a, leaf.b, leaf.c, ray.t_max);
            found = hit && accept(leaf.triangle, hit->u, hit->v);
            const auto outcome = found ? TriangleOutcome::closest
                                 : hit ? TriangleOutcome::rejected
                                       : TriangleOutcome::missed;
            probe.test_triangle(leaf.triangle, outcome, found ? hit->t : ray.t_max);
        }
        return found;
    };
    detail::walk(bvh, ray, ray.t_max, open_leaf, probe);
    return found;
}

template <class Accept = AcceptAll>
[[nodiscard]] std::optional<Hit> closest_hit(const Bvh& bvh, const Ray& ray, Accept&& accept = {}) {
    NullTraversalProbe probe;
    return closest_hit(bvh, ray, accept, probe);
}

template <class Accept = AcceptAll>
[[nodiscard]] bool any_hit(const Bvh& bvh, const Ray& ray, Accept&& accept = {}) {
    NullTraversalProbe probe;
    return any_hit(bvh, ray, accept, probe);
}

}  // namespace pathscope
