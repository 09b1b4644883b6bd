#pragma once
/// The rays of a packet, in rows for the vector registers, and the box of their numbers. Included by packet_kernel.hpp.

#include "wide_kernel.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

inline constexpr std::size_t k_group = 16;      ///< Rays in a register.
inline constexpr float k_most_reach = 0x1p40f;  ///< See BlockEdges.
inline constexpr float k_most_steep = 2;
inline constexpr float k_most_spread = 0.015f;  ///< Beyond it intervals tell little.

/// Calls step(first) for each group of rays.
template <class Step>
inline void each_group(std::size_t groups, Step&& step) {
    for (std::size_t first_ray = 0; first_ray < groups * k_group; first_ray += k_group) step(first_ray);
}

/// The rays of a packet, number by number. Places without a ray, in the last group, repeat the first one, with t_min > t_max.
struct PacketRays {
    using Row = std::array<float, k_packet_rays>;
    std::size_t groups;
    alignas(64) std::array<Row, 3> origin, direction;
    alignas(64) Row t_min, t_max;

    explicit PacketRays(std::span<const Ray> rays) : groups((rays.size() + k_group - 1) / k_group) {
        for (std::size_t i = 0; i < groups * k_group; ++i) {
            const bool used = i < rays.size();
            const Ray& ray = rays[used ? i : 0];
            for (std::size_t axis = 0; axis < 3; ++axis) {
                origin[axis][i] = ray.origin[int(axis)];
                direction[axis][i] = ray.direction[int(axis)];
            }
            t_min[i] = used ? ray.t_min : 1;
            t_max[i] = used ? ray.t_max : -1;
        }
    }
    [[nodiscard]] float farthest() const {
        Float16 t = load16(t_max.data());
        for (std::size_t i = k_group; i < groups * k_group; i += k_group)
            t = max(t, load16(t_max.data() + i));
        return greatest(t);
    }
};

[[nodiscard]] inline Float8 magnitude(Float8 a) { return max(a, broadcast(0.0f) - a); }
[[nodiscard]] inline Float16 magnitude(Float16 a) { return max(a, broadcast16(0.0f) - a); }

/// Lowest and highest of each number over all rays.
struct PacketBounds {
    struct Interval {
        float low, high;
    };
    std::array<Interval, 3> origins, directions;
    float t_min;
    bool one_origin;

    explicit PacketBounds(const PacketRays& rays) {
        const auto interval = [&](const PacketRays::Row& row) {
            Float16 low = load16(row.data()), high = low;
            for (std::size_t i = k_group; i < rays.groups * k_group; i += k_group) {
                low = min(low, load16(row.data() + i));
                high = max(high, load16(row.data() + i));
            }
            return Interval{least(low), greatest(high)};
        };
        t_min = interval(rays.t_min).low;
        one_origin = true;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            origins[axis] = interval(rays.origin[axis]);
            directions[axis] = interval(rays.direction[axis]);
            one_origin &= origins[axis].low == origins[axis].high;
        }
    }
    [[nodiscard]] bool forward(std::size_t axis) const { return directions[axis].low > 0; }
    [[nodiscard]] bool backward(std::size_t axis) const { return directions[axis].high < 0; }
    [[nodiscard]] bool mixed(std::size_t axis) const { return !forward(axis) && !backward(axis); }

    /// The largest direction component.
    [[nodiscard]] float steepest() const {
        float most = 0;
        for (const auto& [low, high] : directions) most = std::max({most, high, -low});
        return most;
    }
    /// The widest interval of directions, as an angle.
    [[nodiscard]] float spread() const {
        float most = 0;
        for (const auto& [low, high] : directions) most = std::max(most, high - low);
        return most / steepest();
    }
    /// How far the scene lies from any of the origins, along any axis.
    [[nodiscard]] float reach(const Box& scene) const {
        float most = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            most = std::max(
                {most, origins[axis].high - scene.low[int(axis)], scene.high[int(axis)] - origins[axis].low});
        return most;
    }
};

/// Whether the rays go together: directions that differ in sign along two axes have little in common, and errors must be
/// within the bounds that the tests of packets are made for.
[[nodiscard]] inline bool suits_packet(const PacketRays& rays, const PacketBounds& bounds, float reach) {
    if (bounds.mixed(0) + bounds.mixed(1) + bounds.mixed(2) > 1) return false;
    if (!(reach < k_most_reach && bounds.steepest() <= k_most_steep)) return false;
    // 1/d of 0 needs a single ray's care.
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t i = 0; bounds.mixed(axis) && i < rays.groups * k_group; i += k_group)
            if (any(at_most(magnitude(load16(rays.direction[axis].data() + i)), broadcast16(0.0f))))
                return false;
    return true;
}

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
