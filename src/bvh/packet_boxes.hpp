#pragma once
/// Which boxes may the rays of a packet meet? Included by packet_kernel.hpp.
///
/// With 1/d in [i_low, i_high] along an axis, no ray of the packet enters the slab before
///
///     t_near = min((near plane - o) i_low, (near plane - o) i_high)        o: the origin that makes it least
///
/// and none leaves it after the corresponding t_far. Rounding is monotonic, so this holds for the numbers that BoxRay
/// would compute for each ray. Where intervals tell little, because the rays begin at different points or their directions
/// differ in sign or by much, each box that is left is tested with each ray too, up to the hit that the ray has already.
/// So no ray misses a leaf that it would open on its own.
///
/// Source: Boulos, Wald & Shirley 2006, "Geometric and Arithmetic Culling Methods for Entire Ray Packets".

#include "packet_rays.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

/// BoxRay for all rays as one, and for each of them.
struct PacketBoxRays {
    struct Slab {
        Float8 near_origin, far_origin, inverse_low, inverse_high;
        std::size_t near, far;  ///< Where the planes lie in WideNode::bounds, in floats.
        bool mixed;
    };
    std::array<Slab, 3> slabs;
    Float8 t_min;
    bool test_each;
    const PacketRays& rays;
    /// Axis by axis; filled if test_each.
    alignas(64) std::array<PacketRays::Row, 3> near_origin, far_origin, inverse;

    PacketBoxRays(const PacketRays& packet, float error)
        : slabs{slab(packet, error, 0), slab(packet, error, 1), slab(packet, error, 2)},
          t_min(broadcast(packet.least_t_min)),
          test_each(!packet.one_origin || packet.spread() > k_most_spread || slabs[0].mixed ||
                    slabs[1].mixed || slabs[2].mixed),
          rays(packet) {
        if (!test_each) return;
        for (std::size_t axis = 0; axis < 3; ++axis)
            for (std::size_t i = 0; i < rays.groups * k_group; i += k_group) {
                const Float16 origin = load16(rays.origin[axis].data() + i);
                const Float16 direction = load16(rays.direction[axis].data() + i);
                const Float16 size = magnitude(origin) * broadcast16(0x1p-22f) + broadcast16(error);
                const Lanes forward = at_most(broadcast16(0.0f), direction);
                store(near_origin[axis].data() + i, select(forward, origin + size, origin - size));
                store(far_origin[axis].data() + i, select(forward, origin - size, origin + size));
                store(inverse[axis].data() + i, broadcast16(1.0f) / direction);
            }
    }

  private:
    static Slab slab(const PacketRays& rays, float error, std::size_t axis) {
        const std::size_t low_plane = axis * k_wide, high_plane = low_plane + 3 * k_wide;
        // Where signs differ the interval of 1/d is infinite: any t is in the slab.
        constexpr float beyond = 0x1p100f;
        if (rays.mixed(axis))
            return {broadcast(beyond),
                    broadcast(-beyond),
                    broadcast(1.0f),
                    broadcast(1.0f),
                    low_plane,
                    high_plane,
                    true};
        const bool backward = rays.backward(axis);
        const auto moved = [&](float origin, float sign) {
            return origin + sign * (std::abs(origin) * 0x1p-22f + error);
        };
        const auto [low, high] = rays.origins[axis];
        return {broadcast(backward ? moved(low, -1) : moved(high, 1)),
                broadcast(backward ? moved(high, 1) : moved(low, -1)),
                broadcast(1 / rays.directions[axis].high),
                broadcast(1 / rays.directions[axis].low),
                backward ? high_plane : low_plane,
                backward ? low_plane : high_plane,
                false};
    }
};

/// plane(which) gives the planes of eight boxes, numbered as in WideNode::bounds, in floats.
template <class Plane>
[[nodiscard]] inline Lanes intersect_boxes(const PacketBoxRays& ray, float t_max, Float8& t_near,
                                           Plane plane) {
    const auto near = [&](const PacketBoxRays::Slab& slab) {
        const Float8 distance = plane(slab.near) - slab.near_origin;
        return min(distance * slab.inverse_low, distance * slab.inverse_high);
    };
    const auto far = [&](const PacketBoxRays::Slab& slab) {
        const Float8 distance = plane(slab.far) - slab.far_origin;
        return max(distance * slab.inverse_low, distance * slab.inverse_high);
    };
    const auto& [x, y, z] = ray.slabs;
    t_near = max(max(near(x), near(y)), max(near(z), ray.t_min));
    const Float8 t_far = min(min(far(x), far(y)), min(far(z), broadcast(t_max)));
    return at_most(t_near, t_far);
}

/// Whether any ray meets the box, whose planes lie k_wide floats apart, before the hit that it has.
[[nodiscard]] inline bool any_ray_meets(const PacketBoxRays& ray, const float* planes) {
    const PacketRays& rays = ray.rays;
    for (std::size_t i = 0; i < rays.groups * k_group; i += k_group) {
        Float16 t_near = load16(rays.t_min.data() + i), t_far = load16(rays.t_max.data() + i);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto& slab = ray.slabs[axis];
            const auto at = [&](std::size_t plane, const PacketRays::Row& origin) {
                return (broadcast16(planes[plane]) - load16(origin.data() + i)) *
                       load16(ray.inverse[axis].data() + i);
            };
            const PacketRays::Row &near = ray.near_origin[axis], &far = ray.far_origin[axis];
            t_near =
                max(slab.mixed ? min(at(slab.near, near), at(slab.far, near)) : at(slab.near, near), t_near);
            t_far = min(slab.mixed ? max(at(slab.near, far), at(slab.far, far)) : at(slab.far, far), t_far);
        }
        if (any(at_most(t_near, t_far))) return true;
    }
    return false;
}

[[nodiscard]] inline Lanes intersect_children(const WideNode& node, const PacketBoxRays& ray, float t_max,
                                              Float8& t_near) {
    const float* const planes = node.bounds[0].data();
    Lanes met = intersect_boxes(ray, t_max, t_near, [&](std::size_t which) { return load(planes + which); });
    if (!ray.test_each) return met;
    for (Lanes left = met; any(left); left = without_first(left))
        if (const int child = first(left); !any_ray_meets(ray, planes + child)) met &= ~(Lanes{1} << child);
    return met;
}

/// The triangles of a block whose own boxes some ray of the packet may meet: few, since a packet is small.
[[nodiscard]] inline Lanes may_meet(const TriangleBlock& block, const PacketBoxRays& ray, float t_max) {
    Float8 t_near;
    return intersect_boxes(ray, t_max, t_near, [&](std::size_t which) {
        const std::size_t axis = which / k_wide % 3;
        const Float8 a = load(block.corners[0][axis].data()), b = load(block.corners[1][axis].data()),
                     c = load(block.corners[2][axis].data());
        return which < 3 * k_wide ? min(a, min(b, c)) : max(a, max(b, c));
    });
}

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
