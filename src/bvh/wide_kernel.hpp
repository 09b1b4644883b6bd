#pragma once
/// The walk through the wide tree. Included by one source file for each instruction set, after that file has chosen it:
/// wide_portable.cpp, wide_avx2.cpp, wide_avx512.cpp.

#include "pathscope/bvh/box_ray.hpp"
#include "pathscope/bvh/wide_traverse.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/geometry/triangle.hpp"
#include "pathscope/math/simd.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

// ---- Eight boxes.

/// BoxRay (bvh/box_ray.hpp) in vector registers, with one step for two:
///
///     (plane - o) / d  =  plane / d  +  offset,      offset = -o / d
///
/// The roundings of the offset and, where the step is not fused, of the product move o by 2 * 2^-24 of itself, of the three that
/// BoxRay has left; of the scene they take no more than the three that they replace. But infinity minus infinity is no number, and
/// would meet every box; so 1/d ends at 2^24 times that of the longest axis. BoxRay moves o by 2^-20 of the scene at least, so a
/// ray in a slab still leaves it at t = 16 scenes, which is behind any hit.
struct WideBoxRay {
    struct Slab {
        Float8 near_offset, far_offset, inverse;
        std::size_t near, far;  ///< Where the planes lie in WideNode::bounds, in floats.
    };
    Slab x, y, z;
    Float8 t_min;

    WideBoxRay(const BoxRay& ray, float least)
        : x(slab(ray, 0, ray.x)), y(slab(ray, 1, ray.y)), z(slab(ray, 2, ray.z)), t_min(broadcast(least)) {}

  private:
    static Slab slab(const BoxRay& ray, int axis, SlabPlanes planes) {
        const float most = 0x1p24f * min_component(abs(ray.inverse));
        const float inverse = std::max(std::min(ray.inverse[axis], most), -most);
        return {broadcast(-ray.near_origin[axis] * inverse), broadcast(-ray.far_origin[axis] * inverse),
                broadcast(inverse), planes.near * k_wide, planes.far * k_wide};
    }
};

/// As intersect_box(), for the eight children of a node. Returns those that are met, and where.
[[nodiscard]] inline Lanes intersect_children(const WideNode& node, const WideBoxRay& ray, float t_max,
                                              Float8& t_near) {
    const float* const planes = node.bounds[0].data();
    const auto near = [&](const WideBoxRay::Slab& slab) {
        return about_multiply_add(load(planes + slab.near), slab.inverse, slab.near_offset);
    };
    const auto far = [&](const WideBoxRay::Slab& slab) {
        return about_multiply_add(load(planes + slab.far), slab.inverse, slab.far_offset);
    };
    t_near = max(max(near(ray.x), near(ray.y)), max(near(ray.z), ray.t_min));
    const Float8 t_far = min(min(far(ray.x), far(ray.y)), min(far(ray.z), broadcast(t_max)));
    return at_most(t_near, t_far);
}

// ---- Eight triangles.

/// Corners as seen along the ray: sheared x and y, and the distance along z.
struct ShearedCorners {
    Float8 x, y, z;
};

struct BlockHits {
    alignas(32) std::array<float, k_wide> t, u, v;
};

/// As intersect_proper_triangle(), step by step and bit by bit, for eight pairs of a ray and a triangle. Returns those that
/// meet; `hits` is written if there are any, and means something in those lanes only.
[[nodiscard]] inline Lanes intersect_sheared(const ShearedCorners& a, const ShearedCorners& b,
                                             const ShearedCorners& c, Float8 inverse_z, Float8 t_min,
                                             Float8 t_max, BlockHits& hits) {
    const Float8 u = c.x * b.y - c.y * b.x;
    const Float8 v = a.x * c.y - a.y * c.x;
    const Float8 w = b.x * a.y - b.y * a.x;
    const Float8 zero = broadcast(0.0f);
    const Lanes inside = at_most(zero, min(u, min(v, w))) | at_most(max(u, max(v, w)), zero);
    if (!any(inside)) return 0;

    const Float8 inverse_sum = broadcast(1.0f) / (u + v + w);  // Infinite where the triangle is seen edge-on.
    const Float8 weight_b = v * inverse_sum, weight_c = w * inverse_sum;
    const Float8 t = (u * inverse_sum * a.z + weight_b * b.z + weight_c * c.z) * inverse_z;
    const Lanes hit = inside & at_most(t_min, t) & at_most(t, t_max);
    if (!any(hit)) return 0;
    store(hits.t.data(), t);
    store(hits.u.data(), weight_b);
    store(hits.v.data(), weight_c);
    return hit;
}

/// The eight triangles of a block and one ray.
[[nodiscard]] inline Lanes intersect_triangles(const TriangleBlock& block, const TriangleRay& ray,
                                               float t_max, BlockHits& hits) {
    const Float8 shear_x = broadcast(ray.shear_x), shear_y = broadcast(ray.shear_y);
    const Float8 origin_x = broadcast(ray.origin_x), origin_y = broadcast(ray.origin_y),
                 origin_z = broadcast(ray.origin_z);
    const auto shear = [&](std::size_t corner) {
        const auto& axes = block.corners[corner];
        const auto at = [&](int axis) { return load(axes[static_cast<std::size_t>(axis)].data()); };
        const Float8 z = at(ray.z) - origin_z;
        return ShearedCorners{fused(shear_x, z, at(ray.x) - origin_x),
                              fused(shear_y, z, at(ray.y) - origin_y), z};
    };
    return intersect_sheared(shear(0), shear(1), shear(2), broadcast(ray.inverse_z), broadcast(ray.t_min),
                             broadcast(t_max), hits);
}

/// Calls found(triangle, hit) for each triangle of the block that the ray meets, until it returns true.
template <class Found, class Probe>
[[nodiscard]] inline bool intersect_block(const TriangleBlock& block, const TriangleRay& ray, float t_max,
                                          Found&& found, Probe& probe) {
    for (const std::uint32_t triangle : block.triangles)
        probe.test_triangle(triangle, TriangleOutcome::missed, t_max);
    BlockHits hits;
    for (Lanes lanes = intersect_triangles(block, ray, t_max, hits); any(lanes);
         lanes = without_first(lanes)) {
        const auto lane = static_cast<std::size_t>(first(lanes));
        if (found(block.triangles[lane], TriangleHit{hits.t[lane], hits.u[lane], hits.v[lane]})) return true;
    }
    return false;
}

// ---- The walk.

/// Children that wait for their turn, the nearest on top. The bits of a float that is not negative are ordered as the float
/// is, so distance and child are one number.
class WideStack {
  public:
    using Entry = std::uint64_t;

    [[nodiscard]] static Entry entry(float t_near, std::uint32_t child) {
        return Entry{std::bit_cast<std::uint32_t>(t_near)} << 32 | child;
    }
    [[nodiscard]] static std::uint32_t child_of(Entry entry) { return static_cast<std::uint32_t>(entry); }

    void push(Entry entry) { entries_[size_++] = entry; }

    /// Puts the last `count` entries in order.
    void sort_top(std::size_t count) {
        Entry* const begin = entries_.data() + size_ - count;
        for (std::size_t i = 1; i < count; ++i) {
            const Entry moving = begin[i];
            std::size_t place = i;
            for (; place > 0 && begin[place - 1] < moving; --place) begin[place] = begin[place - 1];
            begin[place] = moving;
        }
    }

    [[nodiscard]] bool empty() const { return size_ == 0; }
    /// The last child that was pushed. Requires: !empty().
    [[nodiscard]] std::uint32_t pop() { return child_of(entries_[--size_]); }

    /// The next child that begins before t_max; false if there is none left.
    [[nodiscard]] bool pop_before(float t_max, std::uint32_t& child) {
        while (size_ > 0) {
            const Entry next = entries_[--size_];
            if (std::bit_cast<float>(static_cast<std::uint32_t>(next >> 32)) > t_max) continue;
            child = child_of(next);
            return true;
        }
        return false;
    }

  private:
    std::size_t size_ = 0;
    std::array<Entry, k_wide_max_depth*(k_wide - 1) + k_wide> entries_;
};

/// The child in a lane, which is asked for because it will be visited soon.
[[nodiscard]] inline std::uint32_t take_child(const WideBvh& bvh, const WideNode& node, std::size_t lane) {
    const std::uint32_t child = node.children[lane];
    child& k_leaf_child ? prefetch(bvh.blocks[child & ~k_leaf_child]) : prefetch(bvh.nodes[child]);
    return child;
}

/// Of the children that are met, the nearest; the others wait. All of them are on their way from memory at once. Most nodes
/// have three at most: those need no branch that depends on which is nearer.
[[nodiscard]] inline std::uint32_t nearest_child(const WideBvh& bvh, const WideNode& node, Lanes met,
                                                 Float8 t_near, WideStack& stack) {
    alignas(32) std::array<float, k_wide> distances;
    store(distances.data(), t_near);
    const auto take = [&] {
        const auto lane = static_cast<std::size_t>(first(met));
        met = without_first(met);
        return WideStack::entry(distances[lane], take_child(bvh, node, lane));
    };
    const WideStack::Entry one = take();
    if (!any(met)) return WideStack::child_of(one);
    const WideStack::Entry two = take();
    const WideStack::Entry nearer = std::min(one, two), farther = std::max(one, two);
    if (!any(met)) {
        stack.push(farther);
        return WideStack::child_of(nearer);
    }
    const WideStack::Entry three = take();
    const WideStack::Entry between = std::min(farther, three);
    stack.push(std::max(farther, three));
    stack.push(std::max(nearer, between));
    if (!any(met)) return WideStack::child_of(std::min(nearer, between));
    stack.push(std::min(nearer, between));
    std::size_t count = 3;
    for (; any(met); ++count) stack.push(take());
    stack.sort_top(count);
    return stack.pop();
}

/// The last, where a hit is likely for little work (collapse.cpp); the others wait.
[[nodiscard]] inline std::uint32_t likeliest_child(const WideBvh& bvh, const WideNode& node, Lanes met,
                                                   WideStack& stack) {
    for (;;) {
        const std::uint32_t child = take_child(bvh, node, static_cast<std::size_t>(first(met)));
        met = without_first(met);
        if (!any(met)) return child;
        stack.push(child);
    }
}

/// Calls open_block(block) for the blocks that the ray meets before t_max, until it returns true: nearer ones first (as far as
/// boxes tell), or those first that are likeliest to stop it.
template <bool nearest_first, class BoxRays, class OpenBlock, class Probe>
inline void walk(const WideBvh& bvh, const BoxRays& ray, const float& t_max, OpenBlock&& open_block,
                 Probe& probe) {
    WideStack stack;
    std::uint32_t current = 0;
    do {
        probe.enter_node(current);
        while (!(current & k_leaf_child)) {
            const WideNode& node = bvh.nodes[current];
            Float8 t_near;
            const Lanes met = intersect_children(node, ray, t_max, t_near);
            for (std::size_t i = 0; i < k_wide; ++i) probe.test_box(node.children[i], 0, met >> i & 1);
            if (!any(met)) break;
            if constexpr (nearest_first)
                current = nearest_child(bvh, node, met, t_near, stack);
            else
                current = likeliest_child(bvh, node, met, stack);
            probe.enter_node(current);
        }
        if ((current & k_leaf_child) && open_block(bvh.blocks[current & ~k_leaf_child])) return;
        if constexpr (nearest_first) {
            if (!stack.pop_before(t_max, current)) return;
        } else {
            if (stack.empty()) return;
            current = stack.pop();
        }
    } while (true);
}

template <class Probe>
[[nodiscard]] inline std::optional<Hit> find_closest(const WideBvh& bvh, const Ray& ray, HitFilter filter,
                                                     Probe& probe) {
    if (bvh.empty() || !(ray.t_min <= ray.t_max)) return std::nullopt;
    const WideBoxRay box_ray(BoxRay(ray, bvh.bounds), ray.t_min);
    const TriangleRay triangle_ray(ray);
    float t_max = ray.t_max;
    std::optional<Hit> closest;
    const auto keep_closest = [&](std::uint32_t triangle, const TriangleHit& hit) {
        const bool wins =
            !closest || hit.t < closest->t || (hit.t == closest->t && triangle < closest->triangle);
        if (wins && filter(triangle, hit.u, hit.v)) {
            closest = Hit{hit.t, hit.u, hit.v, triangle};
            t_max = hit.t;
        }
        return false;
    };
    const auto open_block = [&](const TriangleBlock& block) {
        return intersect_block(block, triangle_ray, t_max, keep_closest, probe);
    };
    walk<true>(bvh, box_ray, t_max, open_block, probe);
    return closest;
}

template <class Probe>
[[nodiscard]] inline bool find_any(const WideBvh& bvh, const Ray& ray, HitFilter filter, Probe& probe) {
    if (bvh.empty() || !(ray.t_min <= ray.t_max)) return false;
    const WideBoxRay box_ray(BoxRay(ray, bvh.bounds), ray.t_min);
    const TriangleRay triangle_ray(ray);
    const float t_max = ray.t_max;
    bool found = false;
    const auto accept = [&](std::uint32_t triangle, const TriangleHit& hit) {
        return found = filter(triangle, hit.u, hit.v);
    };
    const auto open_block = [&](const TriangleBlock& block) {
        return intersect_block(block, triangle_ray, t_max, accept, probe);
    };
    walk<false>(bvh, box_ray, t_max, open_block, probe);
    return found;
}

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
