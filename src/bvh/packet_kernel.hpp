#pragma once
/// Many rays at once through the wide tree. Included by one source file for each instruction set, as wide_kernel.hpp.
///
/// Rays of neighbouring pixels visit nearly the same nodes. So each box is tested for all of them at once
/// (packet_boxes.hpp), and so is each triangle (packet_triangles.hpp). The hits are those of the rays one by one, bit for bit.
///
/// Source: Wald, Slusallek, Benthin & Wagner 2001, "Interactive Rendering with Coherent Ray Tracing".

#include "occluder_kernel.hpp"
#include "packet_boxes.hpp"
#include "packet_triangles.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

/// False if the rays do not suit: then nothing was done. found() may lower the t_max of a ray; the walk ends where done()
/// is true.
template <bool ordered, class Found, class Done>
[[nodiscard]] inline bool walk_packet(const WideBvh& bvh, PacketRays& rays, Found&& found, Done&& done) {
    if (!rays.suit(bvh.bounds)) return false;
    const PacketBoxRays box_rays(rays, rays.reach(bvh.bounds) * k_box_widening);
    const PacketShear shear(rays);
    float t_max = rays.farthest();
    NullTraversalProbe probe;
    const auto open_block = [&](const TriangleBlock& block) {
        const Lanes triangles = may_meet(block, box_rays, t_max);
        if (!any(triangles)) return false;
        intersect_block(block, triangles, shear, found);
        t_max = rays.farthest();
        return done();
    };
    walk<ordered>(bvh, box_rays, t_max, open_block, probe);
    return true;
}

/// Those of the lanes whose hits count.
[[nodiscard]] inline Lanes filtered(Lanes lanes, HitFilter filter, std::uint32_t triangle,
                                    const GroupHits& hits) {
    if (!filter.accept) return lanes;
    alignas(64) std::array<float, k_group> u, v;
    store(u.data(), hits.u);
    store(v.data(), hits.v);
    Lanes accepted = 0;
    for (Lanes left = lanes; any(left); left = without_first(left)) {
        const auto i = static_cast<std::size_t>(first(left));
        accepted |= Lanes{filter(triangle, u[i], v[i])} << i;
    }
    return accepted;
}

inline void find_closest_packet(const WideBvh& bvh, std::span<const Ray> rays, HitFilter filter,
                                std::span<std::optional<Hit>> closest) {
    if (bvh.empty() || rays.empty()) return std::fill(closest.begin(), closest.end(), std::nullopt);
    PacketRays packet(rays);
    alignas(64) PacketRays::Row u, v;
    alignas(64) std::array<std::uint32_t, k_packet_rays> triangles;
    constexpr std::uint32_t none = 0xffffffff;
    triangles.fill(none);
    const auto keep_closest = [&](std::size_t first_ray, Lanes met, std::uint32_t triangle,
                                  const GroupHits& hits) {
        float* const t_max = packet.t_max.data() + first_ray;
        for (Lanes ties = met & at_most(load16(t_max), hits.t); any(ties); ties = without_first(ties))
            if (triangles[first_ray + std::size_t(first(ties))] < triangle) met &= ~(ties & -ties);
        met = filtered(met, filter, triangle, hits);
        const auto keep = [met](float* row, Float16 news) { store(row, select(met, news, load16(row))); };
        keep(t_max, hits.t);
        keep(u.data() + first_ray, hits.u);
        keep(v.data() + first_ray, hits.v);
        for (; any(met); met = without_first(met)) triangles[first_ray + std::size_t(first(met))] = triangle;
    };
    if (walk_packet<true>(bvh, packet, keep_closest, [] { return false; })) {
        for (std::size_t i = 0; i < rays.size(); ++i)
            closest[i] = triangles[i] == none ? std::nullopt
                                              : std::optional(Hit{packet.t_max[i], u[i], v[i], triangles[i]});
        return;
    }
    NullTraversalProbe probe;
    for (std::size_t i = 0; i < rays.size(); ++i) closest[i] = find_closest(bvh, rays[i], filter, probe);
}

[[nodiscard]] inline std::uint32_t find_any_packet(const WideBvh& bvh, std::span<const Ray> rays,
                                                   HitFilter filter) {
    if (bvh.empty() || rays.empty()) return 0;
    PacketRays packet(rays);
    std::uint32_t met = 0;
    const std::uint32_t all = ~0u >> (k_packet_rays - rays.size());
    const auto accept = [&](std::size_t first_ray, Lanes lanes, std::uint32_t triangle,
                            const GroupHits& hits) {
        lanes = filtered(lanes, filter, triangle, hits);
        met |= lanes << first_ray;
        for (; any(lanes); lanes = without_first(lanes)) {  // These need no more.
            packet.t_max[first_ray + std::size_t(first(lanes))] = -1;
            packet.t_min[first_ray + std::size_t(first(lanes))] = 1;
        }
    };
    if (walk_packet<false>(bvh, packet, accept, [&] { return met == all; })) return met;
    NullTraversalProbe probe;
    for (std::size_t i = 0; i < rays.size(); ++i)
        met |= std::uint32_t{find_any(bvh, rays[i], filter, probe)} << i;
    return met;
}

/// What wide_kernel() hands out.
inline constexpr WideKernel k_kernel{
    [](const WideBvh& bvh, const Ray& ray, HitFilter filter) {
        NullTraversalProbe probe;
        return find_closest(bvh, ray, filter, probe);
    },
    [](const WideBvh& bvh, const Ray& ray, HitFilter filter) {
        NullTraversalProbe probe;
        return find_any(bvh, ray, filter, probe);
    },
    [](const WideBvh& bvh, const Ray& ray, HitFilter filter, TraversalCounts& counts) {
        return find_closest(bvh, ray, filter, counts);
    },
    [](const WideBvh& bvh, const Ray& ray, HitFilter filter, TraversalCounts& counts) {
        return find_any(bvh, ray, filter, counts);
    },
    find_closest_packet,
    find_any_packet,
    find_any_from,
};

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
