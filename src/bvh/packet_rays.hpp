#pragma once
/// The rays of a packet, in rows for the vector registers, and the box of their numbers. Included by packet_kernel.hpp.

#include "wide_kernel.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

inline constexpr std::size_t k_group = 16;  ///< Rays in a register.
inline constexpr std::size_t k_groups = k_packet_rays / k_group;
inline constexpr Lanes k_whole_group = (Lanes{1} << k_group) - 1;
inline constexpr float k_most_reach = 0x1p40f;  ///< See geometry/triangle.hpp and packet_beam.hpp.
inline constexpr float k_most_spread = 0.015f;  ///< Beyond it intervals tell little.

struct Interval {
    float low, high;
};

/// The rays of a packet, number by number, and of each number the lowest and highest over all rays. Places without a ray, in
/// the last group, repeat the first one, with t_min > t_max.
struct PacketRays {
    using Row = std::array<float, k_packet_rays>;
    std::size_t groups;
    alignas(64) std::array<Row, 3> origin, direction;
    alignas(64) Row t_min, t_max;
    std::array<Interval, 3> origins, directions;
    float least_t_min;
    bool one_origin;

    explicit PacketRays(std::span<const Ray> rays) : groups((rays.size() + k_group - 1) / k_group) {
        // A ray is eight numbers: eight rays are a square, which is turned over its diagonal.
        static_assert(sizeof(Ray) == 8 * sizeof(float));
        const std::array rows{origin[0].data(),    origin[1].data(),    origin[2].data(), direction[0].data(),
                              direction[1].data(), direction[2].data(), t_min.data(),     t_max.data()};
        const auto numbers = [&](std::size_t i) {
            alignas(32) const auto ray = std::bit_cast<std::array<float, 8>>(rays[i < rays.size() ? i : 0]);
            return load(ray.data());
        };
        Float8 low = numbers(0), high = low;
        for (std::size_t first_ray = 0; first_ray < groups * k_group; first_ray += 8) {
            std::array<Float8, 8> eight;
            for (std::size_t i = 0; i < 8; ++i) {
                eight[i] = numbers(first_ray + i);
                low = min(low, eight[i]);
                high = max(high, eight[i]);
            }
            eight = transposed(eight);
            for (std::size_t i = 0; i < 8; ++i) store(rows[i] + first_ray, eight[i]);
        }
        for (std::size_t i = rays.size(); i < groups * k_group; ++i) {
            t_min[i] = 1;
            t_max[i] = -1;
        }
        keep_bounds(low, high);
    }

    [[nodiscard]] bool forward(std::size_t axis) const { return directions[axis].low > 0; }
    [[nodiscard]] bool backward(std::size_t axis) const { return directions[axis].high < 0; }
    [[nodiscard]] bool mixed(std::size_t axis) const { return !forward(axis) && !backward(axis); }

    /// The widest interval of directions, as an angle.
    [[nodiscard]] float spread() const {
        float widest = 0, steepest = 0;
        for (const auto& [low, high] : directions) {
            widest = std::max(widest, high - low);
            steepest = std::max({steepest, high, -low});
        }
        return widest / steepest;
    }
    /// How far the scene lies from any of the origins, along any axis.
    [[nodiscard]] float reach(const Box& scene) const {
        float most = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            most = std::max(
                {most, origins[axis].high - scene.low[int(axis)], scene.high[int(axis)] - origins[axis].low});
        return most;
    }
    [[nodiscard]] Interval interval(const Row& row) const {
        Float16 low = load16(row.data()), high = low;
        for (std::size_t i = k_group; i < groups * k_group; i += k_group) {
            low = min(low, load16(row.data() + i));
            high = max(high, load16(row.data() + i));
        }
        return {least(low), greatest(high)};
    }
    [[nodiscard]] float farthest() const {
        Float16 t = load16(t_max.data());
        for (std::size_t i = k_group; i < groups * k_group; i += k_group)
            t = max(t, load16(t_max.data() + i));
        return greatest(t);
    }

    /// Whether the rays go together: directions that differ in sign along two axes have little in common, and errors must be
    /// within the bounds that the tests of packets are made for.
    [[nodiscard]] bool suit(const Box& scene) const {
        if (mixed(0) + mixed(1) + mixed(2) > 1 || !(reach(scene) < k_most_reach)) return false;
        // 1/d of 0 needs a single ray's care.
        for (std::size_t axis = 0; axis < 3; ++axis)
            for (std::size_t i = 0; mixed(axis) && i < groups * k_group; i += k_group)
                if (any(at_most(magnitude(load16(direction[axis].data() + i)), broadcast16(0.0f))))
                    return false;
        return true;
    }

  private:
    void keep_bounds(Float8 low, Float8 high) {
        alignas(32) std::array<float, 8> lows, highs;
        store(lows.data(), low);
        store(highs.data(), high);
        one_origin = true;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            origins[axis] = {lows[axis], highs[axis]};
            directions[axis] = {lows[3 + axis], highs[3 + axis]};
            one_origin &= lows[axis] == highs[axis];
        }
        least_t_min = lows[6];
    }
};

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
