#pragma once
/// Sixteen rays at once through the wide tree. Included after wide_kernel.hpp, by the same source files.
///
/// Rays of neighbouring pixels visit nearly the same nodes. So the boxes are tested once for all of them, by intervals: with
/// all directions in one octant and 1/d in [i_low, i_high] along an axis, no ray of the packet enters the slab before
///
///     t_near = min((near plane - o) i_low, (near plane - o) i_high)        o: the origin that makes it least
///
/// and none leaves it after the corresponding t_far. The same goes for the boxes of single triangles. Rounding is monotonic, so this holds for the numbers that BoxRay would
/// compute for each ray, and no ray misses a leaf that it would open on its own. In the leaves it is the other way round:
/// one triangle is tested with eight rays at a time, each in the arithmetic of a single ray. Hence the same hits, bit for bit.

#include "wide_kernel.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

/// The rays of a packet, number by number.
struct PacketRays {
    using Row = std::array<double, k_packet_rays>;
    int x = 0, y = 0, z = 0;  ///< As in TriangleRay, the same for all.
    alignas(64) Row origin_x{}, origin_y{}, origin_z{}, shear_x{}, shear_y{}, inverse_z{};
    alignas(64) std::array<float, k_packet_rays> t_min{}, t_max{};  ///< Places without a ray: t_min > t_max.

    [[nodiscard]] float farthest() const {
        alignas(32) std::array<float, k_wide> last;
        store(last.data(), max(load(t_max.data()), load(t_max.data() + k_wide)));
        return *std::max_element(last.begin(), last.end());
    }
};

/// The packet as an interval of rays.
struct PacketBoxRay {
    struct Slab {
        Float8 near_origin, far_origin, inverse_low, inverse_high;
        std::size_t near, far;
    };
    Slab x, y, z;
    Float8 t_min;
};

/// Lowest and highest of a component over all rays.
struct PacketBounds {
    Box origins, directions;
    float t_min = k_infinity;

    explicit PacketBounds(std::span<const Ray> rays) {
        for (const Ray& ray : rays) {
            origins.add(ray.origin);
            directions.add(ray.direction);
            t_min = std::min(t_min, ray.t_min);
        }
    }
    /// All directions in the inside of one octant.
    [[nodiscard]] bool coherent() const {
        for (int axis = 0; axis < 3; ++axis)
            if (!(directions.low[axis] > 0 || directions.high[axis] < 0)) return false;
        return true;
    }
};

[[nodiscard]] inline PacketBoxRay packet_box_ray(const PacketBounds& bounds, const Box& scene) {
    const Vec3 reach = max(max(abs(scene.low - bounds.origins.low), abs(scene.high - bounds.origins.low)),
                           max(abs(scene.low - bounds.origins.high), abs(scene.high - bounds.origins.high)));
    const float error = 0x1p-48f * max_component(reach);
    const auto slab = [&](int axis) {
        const bool backward = bounds.directions.high[axis] < 0;
        const auto moved = [&](float origin, float sign) {
            return origin + sign * (std::abs(origin) * 0x1p-22f + error);
        };
        const float low = bounds.origins.low[axis], high = bounds.origins.high[axis];
        const std::size_t low_plane = std::size_t(axis) * k_wide, high_plane = low_plane + 3 * k_wide;
        return PacketBoxRay::Slab{broadcast(backward ? moved(low, -1) : moved(high, 1)),
                                  broadcast(backward ? moved(high, 1) : moved(low, -1)),
                                  broadcast(1 / bounds.directions.high[axis]),
                                  broadcast(1 / bounds.directions.low[axis]),
                                  backward ? high_plane : low_plane,
                                  backward ? low_plane : high_plane};
    };
    return {slab(0), slab(1), slab(2), broadcast(bounds.t_min)};
}

/// plane(which) gives the planes of eight boxes, numbered as in WideNode::bounds, in floats.
template <class Plane>
[[nodiscard]] inline Lanes intersect_boxes(const PacketBoxRay& ray, float t_max, Float8& t_near,
                                           Plane plane) {
    const auto near = [&](const PacketBoxRay::Slab& slab) {
        const Float8 distance = plane(slab.near) - slab.near_origin;
        return min(distance * slab.inverse_low, distance * slab.inverse_high);
    };
    const auto far = [&](const PacketBoxRay::Slab& slab) {
        const Float8 distance = plane(slab.far) - slab.far_origin;
        return max(distance * slab.inverse_low, distance * slab.inverse_high);
    };
    t_near = max(max(near(ray.x), near(ray.y)), max(near(ray.z), ray.t_min));
    const Float8 t_far = min(min(far(ray.x), far(ray.y)), min(far(ray.z), broadcast(t_max)));
    return at_most(t_near, t_far * broadcast(k_far_stretch));
}

[[nodiscard]] inline Lanes intersect_children(const WideNode& node, const PacketBoxRay& ray, float t_max,
                                              Float8& t_near) {
    const float* const planes = node.bounds[0].data();
    return intersect_boxes(ray, t_max, t_near, [&](std::size_t which) { return load(planes + which); });
}

/// The triangles of a block whose own boxes some ray of the packet may meet: few, since a packet is small.
[[nodiscard]] inline Lanes may_meet(const TriangleBlock& block, const PacketBoxRay& ray, float t_max) {
    Float8 t_near;
    return intersect_boxes(ray, t_max, t_near, [&](std::size_t which) {
        const std::size_t axis = which / k_wide % 3;
        const Float8 a = load(block.corners[0][axis].data()), b = load(block.corners[1][axis].data()),
                     c = load(block.corners[2][axis].data());
        return which < 3 * k_wide ? min(a, min(b, c)) : max(a, max(b, c));
    });
}

/// Fills the rows; false if the rays' longest axes differ.
[[nodiscard]] inline bool fill_packet(PacketRays& packet, std::span<const Ray> rays) {
    packet.t_min.fill(1);
    packet.t_max.fill(-1);
    const auto longest = [](Vec3 d) {
        const Vec3 size = abs(d);
        return size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    };
    const int z = longest(rays[0].direction), x = z == 2 ? 0 : z + 1, y = x == 2 ? 0 : x + 1;
    packet.x = x;
    packet.y = y;
    packet.z = z;
    for (std::size_t i = 0; i < rays.size(); ++i) {
        const Ray& ray = rays[i];
        if (longest(ray.direction) != z) return false;
        packet.origin_x[i] = ray.origin[x];
        packet.origin_y[i] = ray.origin[y];
        packet.origin_z[i] = ray.origin[z];
        packet.inverse_z[i] = 1.0 / ray.direction[z];
        packet.shear_x[i] = ray.direction[x] * packet.inverse_z[i];
        packet.shear_y[i] = ray.direction[y] * packet.inverse_z[i];
        packet.t_min[i] = ray.t_min;
        packet.t_max[i] = ray.t_max;
    }
    return true;
}

/// One triangle and the eight rays from `first` on.
[[nodiscard]] inline Lanes intersect_rays(const TriangleBlock& block, std::size_t lane,
                                          const PacketRays& rays, std::size_t first, BlockHits& hits) {
    const auto row = [&](const PacketRays::Row& numbers) { return load(numbers.data() + first); };
    const Double8 shear_x = row(rays.shear_x), shear_y = row(rays.shear_y);
    const auto shear = [&](std::size_t corner) {
        const auto from_origin = [&](int axis, const PacketRays::Row& origin) {
            return broadcast(double(block.corners[corner][static_cast<std::size_t>(axis)][lane])) -
                   row(origin);
        };
        const Double8 z = from_origin(rays.z, rays.origin_z);
        return ShearedCorners{from_origin(rays.x, rays.origin_x) - shear_x * z,
                              from_origin(rays.y, rays.origin_y) - shear_y * z, z};
    };
    return intersect_sheared(shear(0), shear(1), shear(2), row(rays.inverse_z),
                             load(rays.t_min.data() + first), load(rays.t_max.data() + first), hits);
}

/// Calls found(ray, triangle, hit) for each of these triangles of the block and each ray of the packet that meets it.
template <class Found>
inline void intersect_block(const TriangleBlock& block, Lanes triangles, const PacketRays& rays,
                            Found&& found) {
    BlockHits hits;
    for (; any(triangles); triangles = without_first(triangles))
        for (std::size_t first_ray = 0; first_ray < k_packet_rays; first_ray += k_wide) {
            const auto lane = static_cast<std::size_t>(first(triangles));
            for (Lanes met = intersect_rays(block, lane, rays, first_ray, hits); any(met);
                 met = without_first(met)) {
                const auto i = static_cast<std::size_t>(first(met));
                found(first_ray + i, block.triangles[lane], TriangleHit{hits.t[i], hits.u[i], hits.v[i]});
            }
        }
}

/// False if the rays are too different to go together: then nothing was done.
template <bool ordered, class OpenBlock>
[[nodiscard]] inline bool walk_packet(const WideBvh& bvh, std::span<const Ray> rays, PacketRays& packet,
                                      float& t_max, OpenBlock&& open_block) {
    const PacketBounds bounds(rays);
    if (!bounds.coherent() || !fill_packet(packet, rays)) return false;
    t_max = packet.farthest();
    const PacketBoxRay box_ray = packet_box_ray(bounds, bvh.bounds);
    NullTraversalProbe probe;
    const auto open = [&](const TriangleBlock& block) {
        return open_block(block, may_meet(block, box_ray, t_max));
    };
    walk<ordered>(bvh, box_ray, t_max, open, probe);
    return true;
}

inline void find_closest_packet(const WideBvh& bvh, std::span<const Ray> rays, HitFilter filter,
                                std::span<std::optional<Hit>> closest) {
    std::fill(closest.begin(), closest.end(), std::nullopt);
    if (bvh.empty() || rays.empty()) return;
    PacketRays packet;
    float t_max = 0;
    const auto keep_closest = [&](std::size_t ray, std::uint32_t triangle, const TriangleHit& hit) {
        std::optional<Hit>& best = closest[ray];
        const bool wins = !best || hit.t < best->t || (hit.t == best->t && triangle < best->triangle);
        if (!wins || !filter(triangle, hit.u, hit.v)) return;
        best = Hit{hit.t, hit.u, hit.v, triangle};
        packet.t_max[ray] = hit.t;
    };
    const auto open_block = [&](const TriangleBlock& block, Lanes triangles) {
        intersect_block(block, triangles, packet, keep_closest);
        t_max = packet.farthest();
        return false;
    };
    if (walk_packet<true>(bvh, rays, packet, t_max, open_block)) return;
    NullTraversalProbe probe;
    for (std::size_t i = 0; i < rays.size(); ++i) closest[i] = find_closest(bvh, rays[i], filter, probe);
}

[[nodiscard]] inline std::uint32_t find_any_packet(const WideBvh& bvh, std::span<const Ray> rays,
                                                   HitFilter filter) {
    if (bvh.empty() || rays.empty()) return 0;
    PacketRays packet;
    float t_max = 0;
    std::uint32_t met = 0;
    const auto accept = [&](std::size_t ray, std::uint32_t triangle, const TriangleHit& hit) {
        if (!filter(triangle, hit.u, hit.v)) return;
        met |= 1u << ray;
        packet.t_max[ray] = -1;  // It needs no more.
        packet.t_min[ray] = 1;
    };
    const auto open_block = [&](const TriangleBlock& block, Lanes triangles) {
        intersect_block(block, triangles, packet, accept);
        t_max = packet.farthest();
        return met == (1u << rays.size()) - 1;
    };
    if (walk_packet<false>(bvh, rays, packet, t_max, open_block)) return met;
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
};

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
