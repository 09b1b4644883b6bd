#pragma once
/// Which triangles of a block do the rays of a packet meet? Included by packet_kernel.hpp.
///
/// One triangle is tested with many rays at a time. An estimate in floats, whose error is bounded, rules most of them out;
/// what is left is tested in the arithmetic of a single ray. Hence the same hits, bit for bit.

#include "packet_rays.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

// ---- Triangles: an estimate for all rays.

/// The rays as lines. The ray o + t d passes the edge from p to q on the side that is the sign of
///
///     d · (p - o) x (q - o)  =  d · (p x q)  +  (p - q) · (d x o)
///
/// and meets the triangle if it passes its three edges on the same side. What depends on the triangle and what depends on
/// the ray are apart: so a ray takes six products for an edge, or three where all rays begin at one point, which then is the
/// centre of coordinates.
struct PacketLines {
    const PacketRays& rays;
    bool one_origin;
    std::array<float, 3> centre;
    float farthest_origin = 0;  ///< Over axes and rays, from the centre.
    float steepest;
    alignas(64) std::array<PacketRays::Row, 3> moment;  ///< d x o; filled if the origins differ.

    PacketLines(const PacketRays& packet, const PacketBounds& bounds)
        : rays(packet), one_origin(bounds.one_origin), steepest(bounds.steepest()) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto [low, high] = bounds.origins[axis];
            centre[axis] = low;
            farthest_origin = std::max(farthest_origin, high - low);
        }
        if (one_origin) return;
        each_group(rays.groups, [&](std::size_t first_ray) {
            std::array<Float16, 3> d, o;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                d[axis] = load16(rays.direction[axis].data() + first_ray);
                o[axis] = load16(rays.origin[axis].data() + first_ray) - broadcast16(centre[axis]);
            }
            for (std::size_t i = 0; i < 3; ++i) {
                const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
                store(moment[i].data() + first_ray, d[j] * o[k] - d[k] * o[j]);
            }
        });
    }
};

/// The triangles' part of it, for the eight of a block.
///
/// margin: by how much the estimate may differ from what the test itself finds. With |coordinates| of the corners up to R, of
/// the origins up to O, both from the centre, of the directions up to D, and u = 2^-24, the roundings of all steps of the
/// estimate add up to u D R (58 R + 108 O), but for terms of u². The test (geometry/triangle.hpp), times d.z, has coordinates
/// up to 2 M that are off by 5 u M, M = R + O: two products of them are off by 2 (2 * 2 * 5 + 4) u M² D. Together that is
/// less than 128 u M² D. Products so small that they lose digits add less than 2^-100: each is off by
/// 2^-149 at most, and is multiplied by numbers below k_most_steep and k_most_reach.
struct BlockEdges {
    using Row = std::array<float, k_wide>;
    alignas(32) std::array<std::array<Row, 3>, 3> cross, difference;  ///< [edge][axis]: p x q, p - q
    alignas(32) Row margin;

    BlockEdges(const TriangleBlock& block, const PacketLines& lines) {
        std::array<std::array<Float8, 3>, 3> corner;
        Float8 size = broadcast(0.0f);
        for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const Float8 x = load(block.corners[i][axis].data()) - broadcast(lines.centre[axis]);
                corner[i][axis] = x;
                size = max(magnitude(x), size);
            }
        for (std::size_t i = 0; i < 3; ++i) {
            const auto &p = corner[i], &q = corner[(i + 1) % 3];
            for (std::size_t axis = 0; axis < 3; ++axis) {
                const std::size_t j = (axis + 1) % 3, k = (axis + 2) % 3;
                store(cross[i][axis].data(), p[j] * q[k] - p[k] * q[j]);
                if (!lines.one_origin) store(difference[i][axis].data(), p[axis] - q[axis]);
            }
        }
        const Float8 most = size + broadcast(lines.farthest_origin);
        store(margin.data(), most * most * broadcast(128 * 0x1p-24f * lines.steepest) + broadcast(0x1p-100f));
    }

    /// Of the group of rays, those that may meet the triangle in this lane.
    [[nodiscard]] Lanes may_meet(std::size_t lane, const PacketLines& lines, std::size_t first_ray) const {
        const auto side = [&](std::size_t edge) {
            const auto term = [&](const PacketRays::Row& row, const Row& factor, Float16 sum) {
                return about_multiply_add(load16(row.data() + first_ray), broadcast16(factor[lane]), sum);
            };
            const auto& d = lines.rays.direction;
            Float16 sum = load16(d[0].data() + first_ray) * broadcast16(cross[edge][0][lane]);
            for (std::size_t axis = 1; axis < 3; ++axis) sum = term(d[axis], cross[edge][axis], sum);
            if (!lines.one_origin)
                for (std::size_t axis = 0; axis < 3; ++axis)
                    sum = term(lines.moment[axis], difference[edge][axis], sum);
            return sum;
        };
        const Float16 u = side(0), v = side(1), w = side(2);
        const float off = margin[lane];
        return at_most(broadcast16(-off), min(u, min(v, w))) | at_most(max(u, max(v, w)), broadcast16(off));
    }
};

// ---- Triangles: the test itself.

/// The rows of TriangleRay.
struct PacketTriangleRays {
    using Row = PacketRays::Row;
    alignas(64) Row origin_x, origin_y, origin_z, shear_x, shear_y, inverse_z;
    /// Of each eight rays, those whose longest axis is x, or y; that of the others is z.
    std::array<Lanes, k_packet_rays / k_wide> longest_x, longest_y;
    const PacketRays& rays;

    explicit PacketTriangleRays(const PacketRays& packet) : rays(packet) {
        for (std::size_t i = 0; i < rays.groups * k_group; i += k_wide) {
            const auto row = [&](const PacketRays::Row& numbers) { return load(numbers.data() + i); };
            const auto size = [&](std::size_t axis) { return magnitude(row(rays.direction[axis])); };
            const Float8 x = size(0), y = size(1), z = size(2);
            longest_x[i / k_wide] = at_most(y, x) & at_most(z, x);
            longest_y[i / k_wide] = ~longest_x[i / k_wide] & at_most(z, y) & k_all_wide;
            const auto along = [&](std::size_t which, const std::array<PacketRays::Row, 3>& rows) {
                return permuted(which, i, row(rows[0]), row(rows[1]), row(rows[2]));
            };
            const Float8 zero = broadcast(0.0f), d_z = along(2, rays.direction);
            store(inverse_z.data() + i, broadcast(1.0f) / d_z);
            store(shear_x.data() + i, (zero - along(0, rays.direction)) / d_z);
            store(shear_y.data() + i, (zero - along(1, rays.direction)) / d_z);
            store(origin_x.data() + i, along(0, rays.origin));
            store(origin_y.data() + i, along(1, rays.origin));
            store(origin_z.data() + i, along(2, rays.origin));
        }
    }

    /// Coordinate 0, 1, 2 of the eight rays' own axes x, y, z, of which z is the longest; as in TriangleRay.
    [[nodiscard]] Float8 permuted(std::size_t which, std::size_t first_ray, Float8 x, Float8 y,
                                  Float8 z) const {
        const std::array<Float8, 3> axes{x, y, z};
        const Lanes along_x = longest_x[first_ray / k_wide], along_y = longest_y[first_ray / k_wide];
        const Float8 if_x = axes[(which + 1) % 3], if_y = axes[(which + 2) % 3], if_z = axes[which];
        if (along_x == k_all_wide) return if_x;
        if (along_y == k_all_wide) return if_y;
        return select(along_x, if_x, select(along_y, if_y, if_z));
    }
    static constexpr Lanes k_all_wide = (Lanes{1} << k_wide) - 1;
};

/// One triangle and the eight rays from `first` on.
[[nodiscard]] inline Lanes intersect_rays(const TriangleBlock& block, std::size_t lane,
                                          const PacketTriangleRays& rays, std::size_t first,
                                          BlockHits& hits) {
    const auto row = [&](const PacketTriangleRays::Row& numbers) { return load(numbers.data() + first); };
    const Float8 shear_x = row(rays.shear_x), shear_y = row(rays.shear_y);
    const auto shear = [&](std::size_t corner) {
        const auto& axes = block.corners[corner];
        const Float8 a = broadcast(axes[0][lane]), b = broadcast(axes[1][lane]), c = broadcast(axes[2][lane]);
        const auto from_origin = [&](std::size_t which, const PacketTriangleRays::Row& origin) {
            return rays.permuted(which, first, a, b, c) - row(origin);
        };
        const Float8 z = from_origin(2, rays.origin_z);
        return ShearedCorners{fused(shear_x, z, from_origin(0, rays.origin_x)),
                              fused(shear_y, z, from_origin(1, rays.origin_y)), z};
    };
    return intersect_sheared(shear(0), shear(1), shear(2), row(rays.inverse_z),
                             load(rays.rays.t_min.data() + first), load(rays.rays.t_max.data() + first),
                             hits);
}

/// Calls found(first ray, which of the eight from there, triangle, hits) for these triangles of the block and the rays that
/// meet them.
template <class Found>
inline void intersect_block(const TriangleBlock& block, Lanes triangles, const PacketLines& lines,
                            const PacketTriangleRays& rays, Found&& found) {
    if (!any(triangles)) return;
    const BlockEdges edges(block, lines);
    BlockHits hits;
    each_group(rays.rays.groups, [&](std::size_t group) {
        // All estimates first: no branch depends on them, so they overlap.
        std::array<Lanes, k_wide> candidates;
        Lanes wanted = 0;
        for (Lanes left = triangles; any(left); left = without_first(left)) {
            const auto lane = static_cast<std::size_t>(first(left));
            candidates[lane] = edges.may_meet(lane, lines, group);
            wanted |= Lanes{candidates[lane] != 0} << lane;
        }
        for (; any(wanted); wanted = without_first(wanted)) {
            const auto lane = static_cast<std::size_t>(first(wanted));
            for (const std::size_t half : {std::size_t{0}, std::size_t{k_wide}}) {
                if (!any(candidates[lane] >> half & PacketTriangleRays::k_all_wide)) continue;
                const Lanes met = intersect_rays(block, lane, rays, group + half, hits);
                if (any(met)) found(group + half, met, block.triangles[lane], hits);
            }
        }
    });
}

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
