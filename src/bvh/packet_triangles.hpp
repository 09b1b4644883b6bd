#pragma once
/// Which triangles of a block do the rays of a packet meet? Included by packet_kernel.hpp.
///
/// One triangle is tested with sixteen rays at a time, in the arithmetic of a single ray (geometry/triangle.hpp), step by step.
/// Hence the same hits, bit for bit. Triangles that no ray can meet are ruled out before, eight at a time (packet_beam.hpp).

#include "packet_beam.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

struct GroupHits {
    Float16 t, u, v;
};

/// Calls found(first ray, which of the sixteen from there, triangle, hits) for these triangles of the block and those rays of the
/// part that meet them.
template <bool one_origin, class Found>
inline void intersect_part(const TriangleBlock& block, Lanes triangles, const PacketShear& shear,
                           const PacketShear::Part& part, Found&& found) {
    const PacketRays& rays = shear.rays;
    const BlockCorners seen(block, rays, part);
    if (shear.is_beam) triangles &= may_meet(seen, shear);

    const auto in_group = [](const PacketRays::Row& row, std::size_t group) {
        return load16(row.data() + group * k_group);
    };
    const auto from_origin = [&](std::size_t corner, std::size_t axis, std::size_t lane, std::size_t group) {
        const Float16 a = broadcast16(seen.corners[corner][axis][lane]);
        return one_origin ? a : a - in_group(rays.origin[part.axes[axis]], group);
    };

    // All edges first: no branch depends on them, so they overlap.
    alignas(64) std::array<std::array<PacketRays::Row, 3>, k_wide> weights;
    std::array<std::array<Lanes, k_groups>, k_wide> inside;
    const auto weight = [&](std::size_t lane, std::size_t corner, std::size_t group) {
        return weights[lane][corner].data() + group * k_group;
    };
    Lanes wanted = 0;
    for (; any(triangles); triangles = without_first(triangles)) {
        const auto lane = static_cast<std::size_t>(first(triangles));
        Lanes any_inside = 0;
        for (std::size_t group = 0; group < rays.groups; ++group) {
            const Float16 shear_x = in_group(shear.shear_x, group), shear_y = in_group(shear.shear_y, group);
            const auto sheared = [&](std::size_t corner) {
                const Float16 z = from_origin(corner, 2, lane, group);
                return std::pair(fused(shear_x, z, from_origin(corner, 0, lane, group)),
                                 fused(shear_y, z, from_origin(corner, 1, lane, group)));
            };
            const auto [a_x, a_y] = sheared(0);
            const auto [b_x, b_y] = sheared(1);
            const auto [c_x, c_y] = sheared(2);
            const Float16 u = c_x * b_y - c_y * b_x;
            const Float16 v = a_x * c_y - a_y * c_x;
            const Float16 w = b_x * a_y - b_y * a_x;
            const Float16 zero = broadcast16(0.0f);
            const Lanes one_side = at_most(zero, min(u, min(v, w))) | at_most(max(u, max(v, w)), zero);
            any_inside |= inside[lane][group] = one_side & part.lanes[group];
            store(weight(lane, 0, group), u);
            store(weight(lane, 1, group), v);
            store(weight(lane, 2, group), w);
        }
        wanted |= Lanes{any(any_inside)} << lane;
    }
    for (; any(wanted); wanted = without_first(wanted)) {
        const auto lane = static_cast<std::size_t>(first(wanted));
        for (std::size_t group = 0; group < rays.groups; ++group) {
            if (!any(inside[lane][group])) continue;
            const Float16 u = load16(weight(lane, 0, group)), v = load16(weight(lane, 1, group)),
                          w = load16(weight(lane, 2, group));
            const Float16 inverse_sum = broadcast16(1.0f) / (u + v + w);
            const Float16 weight_b = v * inverse_sum, weight_c = w * inverse_sum;
            const Float16 t =
                (u * inverse_sum * from_origin(0, 2, lane, group) +
                 weight_b * from_origin(1, 2, lane, group) + weight_c * from_origin(2, 2, lane, group)) *
                in_group(shear.inverse_z, group);
            const Lanes met = inside[lane][group] & at_most(in_group(rays.t_min, group), t) &
                              at_most(t, in_group(rays.t_max, group));
            if (any(met))
                found(group * k_group, met, block.triangles[lane], GroupHits{t, weight_b, weight_c});
        }
    }
}

template <class Found>
inline void intersect_block(const TriangleBlock& block, Lanes triangles, const PacketShear& shear,
                            Found&& found) {
    for (std::size_t i = 0; i < shear.part_count; ++i)
        shear.rays.one_origin ? intersect_part<true>(block, triangles, shear, shear.parts[i], found)
                              : intersect_part<false>(block, triangles, shear, shear.parts[i], found);
}

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
