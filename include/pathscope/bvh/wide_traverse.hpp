#pragma once
/// Which triangle does a ray meet first, and does it meet any: for the wide tree.
///
/// The text of the walk is src/bvh/wide_kernel.hpp; it is compiled once for each instruction set, and the one that suits
/// the machine is chosen when the program starts (math/simd_level.hpp).
///
/// Ensures, Requires: as traverse.hpp. The answers are the same bits with every instruction set, and the same as those of
/// the binary tree.
/// Thread safety: pure, as far as the filter is.
/// Test: tests/bvh/test_wide.cpp (against brute force and the binary tree, at each level of instructions)

#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>

#include "pathscope/bvh/occluder_cache.hpp"
#include "pathscope/bvh/traversal_probe.hpp"
#include "pathscope/bvh/traverse.hpp"
#include "pathscope/bvh/wide_bvh.hpp"
#include "pathscope/geometry/hit.hpp"
#include "pathscope/math/ray.hpp"
#include "pathscope/math/simd_level.hpp"

namespace pathscope {

/// Which hits count: a function that crosses the border between instruction sets, asked only for hits of single triangles.
struct HitFilter {
    bool (*accept)(const void* context, std::uint32_t triangle, float u, float v) = nullptr;  ///< Null: all.
    const void* context = nullptr;

    [[nodiscard]] bool operator()(std::uint32_t triangle, float u, float v) const {
        return !accept || accept(context, triangle, u, v);
    }
};

/// From anything that can be called as accept(triangle, u, v) of traverse.hpp. It must outlive the query.
template <class Accept>
[[nodiscard]] HitFilter hit_filter(const Accept& accept) {
    if constexpr (std::is_same_v<Accept, AcceptAll>) return {};
    return {[](const void* context, std::uint32_t triangle, float u, float v) -> bool {
                return (*static_cast<const Accept*>(context))(triangle, u, v);
            },
            &accept};
}

inline constexpr std::size_t k_packet_rays = 32;

/// The walk for one instruction set.
struct WideKernel {
    std::optional<Hit> (*closest_hit)(const WideBvh&, const Ray&, HitFilter);
    bool (*any_hit)(const WideBvh&, const Ray&, HitFilter);
    std::optional<Hit> (*count_closest_hit)(const WideBvh&, const Ray&, HitFilter, TraversalCounts&);
    bool (*count_any_hit)(const WideBvh&, const Ray&, HitFilter, TraversalCounts&);
    void (*closest_hit_packet)(const WideBvh&, std::span<const Ray>, HitFilter,
                               std::span<std::optional<Hit>>);
    std::uint32_t (*any_hit_packet)(const WideBvh&, std::span<const Ray>, HitFilter);
    bool (*any_hit_from)(const WideBvh&, const Ray&, HitFilter, std::uint32_t& occluder);
};

/// Requires: level <= highest_simd_level().
[[nodiscard]] const WideKernel& wide_kernel(SimdLevel level);

namespace detail {
extern const WideKernel& k_wide_kernel;  ///< That of simd_level().
}

template <class Accept = AcceptAll>
[[nodiscard]] std::optional<Hit> closest_hit(const WideBvh& bvh, const Ray& ray, const Accept& accept = {}) {
    return detail::k_wide_kernel.closest_hit(bvh, ray, hit_filter(accept));
}

template <class Accept = AcceptAll>
[[nodiscard]] bool any_hit(const WideBvh& bvh, const Ray& ray, const Accept& accept = {}) {
    return detail::k_wide_kernel.any_hit(bvh, ray, hit_filter(accept));
}

/// any_hit(bvh, ray, accept), sooner where rays before it were stopped by the same things (occluder_cache.hpp).
template <class Accept>
[[nodiscard]] bool any_hit(const WideBvh& bvh, const Ray& ray, const Accept& accept,
                           OccluderCache& occluders) {
    return detail::k_wide_kernel.any_hit_from(bvh, ray, hit_filter(accept), occluders.towards(ray.direction));
}

// The same, counted: a block of triangles is a node, and all of its places are triangles that were tested.

template <class Accept>
[[nodiscard]] std::optional<Hit> closest_hit(const WideBvh& bvh, const Ray& ray, const Accept& accept,
                                             TraversalCounts& counts) {
    return detail::k_wide_kernel.count_closest_hit(bvh, ray, hit_filter(accept), counts);
}

template <class Accept>
[[nodiscard]] bool any_hit(const WideBvh& bvh, const Ray& ray, const Accept& accept,
                           TraversalCounts& counts) {
    return detail::k_wide_kernel.count_any_hit(bvh, ray, hit_filter(accept), counts);
}

// Packets: up to k_packet_rays rays of neighbouring pixels, several times as fast together as one by one. The answers are those
// of the rays one by one, bit for bit; rays that are too different for a packet are traced so.

/// closest[i] = closest_hit(bvh, rays[i], accept). Requires: at most k_packet_rays of them, as many places in closest.
template <class Accept = AcceptAll>
void closest_hits(const WideBvh& bvh, std::span<const Ray> rays, std::span<std::optional<Hit>> closest,
                  const Accept& accept = {}) {
    detail::k_wide_kernel.closest_hit_packet(bvh, rays, hit_filter(accept), closest);
}

/// Bit i = any_hit(bvh, rays[i], accept). Requires: at most k_packet_rays of them.
template <class Accept = AcceptAll>
[[nodiscard]] std::uint32_t any_hits(const WideBvh& bvh, std::span<const Ray> rays,
                                     const Accept& accept = {}) {
    return detail::k_wide_kernel.any_hit_packet(bvh, rays, hit_filter(accept));
}

}  // namespace pathscope
