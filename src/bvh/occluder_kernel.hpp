#pragma once
/// Any hit, beginning with what stopped a ray like this one before (bvh/occluder_cache.hpp). Included by packet_kernel.hpp.

#include "pathscope/bvh/occluder_cache.hpp"
#include "wide_kernel.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

/// As find_any(). `occluder` is asked first, and becomes the block that stops this ray. A text of its own, because find_any() by way of
/// it is slower, by a twentieth, for those that keep no occluders.
[[nodiscard]] inline bool find_any_from(const WideBvh& bvh, const Ray& ray, HitFilter filter,
                                        std::uint32_t& occluder) {
    if (bvh.empty() || !(ray.t_min <= ray.t_max)) return false;
    const TriangleRay triangle_ray(ray);
    const float t_max = ray.t_max;
    NullTraversalProbe probe;
    const auto accept = [&](std::uint32_t triangle, const TriangleHit& hit) {
        return filter(triangle, hit.u, hit.v);
    };
    const auto stops = [&](const TriangleBlock& block) {
        return intersect_block(block, triangle_ray, t_max, accept, probe);
    };
    if (occluder < bvh.blocks.size() && stops(bvh.blocks[occluder])) return true;

    occluder = k_no_occluder;
    const auto open_block = [&](const TriangleBlock& block) {
        if (!stops(block)) return false;
        occluder = static_cast<std::uint32_t>(&block - bvh.blocks.data());
        return true;
    };
    const WideBoxRay box_ray(BoxRay(ray, bvh.bounds), ray.t_min);
    walk<false>(bvh, box_ray, t_max, open_block, probe);
    return occluder != k_no_occluder;
}

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
