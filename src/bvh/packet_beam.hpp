#pragma once
/// The rays of a packet as the triangle test sees them, and the triangles that none of them can meet. Included by
/// packet_triangles.hpp.
///
/// With A = a - o the test (geometry/triangle.hpp) compares the sign of
///
///     U(s) = C'.x B'.y - C'.y B'.x,      B' = (B.x + s.x B.z, B.y + s.y B.z), C' likewise
///
/// and of V, W. Where rays have one origin o and one longest axis z, they differ in the shear s alone, and U is linear in it: the
/// products of s.x and s.y cancel,
///
///     U(s) = (C.x B.y - C.y B.x)  +  s.x (C.z B.y - C.y B.z)  +  s.y (C.x B.z - C.z B.x)
///
/// So the ends of U over the rectangle of all shears are known, and a triangle is met by some ray only if the highest values of U,
/// V, W are not negative, or the lowest not positive.
///
/// Error: with u = 2^-24, |coordinates| of A, B, C up to M and |s| <= 1, the coordinates of A' are up to 2 M. The test's two
/// products are off by 3 u (2 M)² each. Here the three coefficients are off by 4 u M² each, the middle of the rectangle
/// and its half sides by 8 u M² together, and sums and products by 14 u M² for the value in the middle, 8 u M² for the
/// reach and 10 u M² for their sum. All that is 76 u M², and terms of u²: the margin is 128. Products so small that they
/// lose digits add less than 2^-100: each is off by 2^-149 at most, and is multiplied by numbers below k_most_reach.
///
/// Source: Reshetov, Soupikov & Hurley 2005, "Multi-Level Ray Tracing Algorithm" (beams); Woop, Benthin & Wald 2013 (shear).

#include "packet_rays.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

/// TriangleRay for all rays.
struct PacketShear {
    /// The rays whose longest axis is the same: axes = x, y, z of TriangleRay.
    struct Part {
        std::array<std::size_t, 3> axes;
        std::array<Lanes, k_groups> lanes{};
    };
    const PacketRays& rays;
    alignas(64) PacketRays::Row shear_x, shear_y, inverse_z;
    std::array<Part, 3> parts;
    std::size_t part_count = 0;
    bool is_beam;             ///< One origin and one longest axis.
    Interval beam_x, beam_y;  ///< Of the shears, if so.

    explicit PacketShear(const PacketRays& packet) : rays(packet) {
        std::array<Part, 3> longest{Part{{1, 2, 0}}, Part{{2, 0, 1}}, Part{{0, 1, 2}}};
        for (std::size_t group = 0; group < rays.groups; ++group) {
            const auto size = [&](std::size_t axis) {
                return magnitude(load16(rays.direction[axis].data() + group * k_group));
            };
            const Float16 x = size(0), y = size(1), z = size(2);
            const Lanes along_x = at_most(y, x) & at_most(z, x), along_y = at_most(z, y) & ~along_x;
            longest[0].lanes[group] = along_x;
            longest[1].lanes[group] = along_y;
            longest[2].lanes[group] = k_whole_group & ~(along_x | along_y);
            for (const Part& part : longest) fill(part, group);
        }
        for (const Part& part : longest)
            if (std::any_of(part.lanes.begin(), part.lanes.end(), [](Lanes some) { return any(some); }))
                parts[part_count++] = part;
        is_beam = rays.one_origin && part_count == 1;
        if (!is_beam) return;
        beam_x = rays.interval(shear_x);
        beam_y = rays.interval(shear_y);
    }

  private:
    void fill(const Part& part, std::size_t group) {
        const Lanes lanes = part.lanes[group];
        if (!any(lanes)) return;
        const auto direction = [&](std::size_t axis) {
            return load16(rays.direction[part.axes[axis]].data() + group * k_group);
        };
        const auto keep = [&](PacketRays::Row& row, Float16 numbers) {
            float* const place = row.data() + group * k_group;
            store(place, lanes == k_whole_group ? numbers : select(lanes, numbers, load16(place)));
        };
        const Float16 minus = broadcast16(-1.0f), z = direction(2);
        keep(shear_x, minus * direction(0) / z);
        keep(shear_y, minus * direction(1) / z);
        keep(inverse_z, broadcast16(1.0f) / z);
    }
};

/// The corners of the triangles in a block, along the axes of a part: as seen from the rays' origin, if that is one; else as they
/// are.
struct BlockCorners {
    alignas(32) std::array<std::array<std::array<float, k_wide>, 3>, 3> corners;  ///< [corner][axis][lane]

    BlockCorners(const TriangleBlock& block, const PacketRays& rays, const PacketShear::Part& part) {
        for (std::size_t corner = 0; corner < 3; ++corner)
            for (std::size_t i = 0; i < 3; ++i) {
                const std::size_t axis = part.axes[i];
                const Float8 a = load(block.corners[corner][axis].data());
                store(corners[corner][i].data(), rays.one_origin ? a - broadcast(rays.origins[axis].low) : a);
            }
    }
    [[nodiscard]] Float8 row(std::size_t corner, std::size_t axis) const {
        return load(corners[corner][axis].data());
    }
};

/// The triangles that the beam may meet. Requires: shear.is_beam.
[[nodiscard]] inline Lanes may_meet(const BlockCorners& block, const PacketShear& shear) {
    const auto middle = [](Interval of) { return broadcast(0.5f * (of.low + of.high)); };
    const auto half = [](Interval of) { return broadcast(0.5f * (of.high - of.low)); };
    const Float8 middle_x = middle(shear.beam_x), middle_y = middle(shear.beam_y);
    const Float8 half_x = half(shear.beam_x), half_y = half(shear.beam_y);

    Float8 size = broadcast(0.0f);
    for (std::size_t i = 0; i < 9; ++i) size = max(magnitude(block.row(i / 3, i % 3)), size);
    const Float8 margin = size * size * broadcast(128 * 0x1p-24f) + broadcast(0x1p-100f);

    Float8 least_high = broadcast(k_infinity), greatest_low = broadcast(-k_infinity);
    for (std::size_t i = 0; i < 3; ++i) {
        const auto cross = [&](std::size_t one, std::size_t other) {
            const std::size_t j = (i + 1) % 3;
            return block.row(j, one) * block.row(i, other) - block.row(j, other) * block.row(i, one);
        };
        const Float8 x = cross(2, 1), y = cross(0, 2);
        const Float8 value = about_multiply_add(x, middle_x, about_multiply_add(y, middle_y, cross(0, 1)));
        const Float8 reach = about_multiply_add(magnitude(x), half_x, magnitude(y) * half_y);
        least_high = min(value + reach, least_high);
        greatest_low = max(value - reach, greatest_low);
    }
    return at_most(broadcast(0.0f) - margin, least_high) | at_most(greatest_low, margin);
}

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
