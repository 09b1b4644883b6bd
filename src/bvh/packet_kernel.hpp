#pragma once
/// Sixteen rays at once through the wide tree. Included after wide_kernel.hpp, by the same source files.
///
/// Rays of neighbouring pixels visit nearly the same nodes. So the boxes are tested twice. First once for all rays, by
/// intervals: with all directions in one octant and 1/d in [i_low, i_high] along an axis, no ray of the packet enters the
/// slab before
///
///     t_near = min((near plane - o) i_low, (near plane - o) i_high)        o: the origin that makes it least
///
/// and none leaves it after the corresponding t_far. The same goes for the boxes of single triangles. Rounding is
/// monotonic, so this holds for the numbers that BoxRay would compute for each ray. Then the few boxes that are left are
/// tested with each ray, up to the hit that the ray has already: a box that only rays with nearer hits pass through is
/// not entered. So no ray misses a leaf that it would open on its own. In the leaves it is the other way round: one
/// triangle is tested with eight rays at a time, each in the arithmetic of a single ray. Hence the same hits, bit for bit.

#include "wide_kernel.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

/// The rays of a packet, number by number. Places without a ray repeat the first one, with t_min > t_max.
struct PacketRays {
    using Row = std::array<double, k_packet_rays>;
    using FloatRow = std::array<float, k_packet_rays>;
    alignas(64) std::array<FloatRow, 3> origin, direction;
    alignas(64) FloatRow t_min, t_max;

    /// As in TriangleRay; the axes are the same for all.
    int x = 0, y = 0, z = 0;
    alignas(64) Row origin_x, origin_y, origin_z, shear_x, shear_y, inverse_z;
    /// As in BoxRay, axis by axis.
    alignas(64) std::array<FloatRow, 3> near_origin, far_origin, inverse;

    explicit PacketRays(std::span<const Ray> rays) {
        for (std::size_t i = 0; i < k_packet_rays; ++i) {
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
};

/// Calls step(first) for the rays from `first` on, eight at a time.
template <class Step>
inline void each_eight(Step&& step) {
    for (std::size_t first_ray = 0; first_ray < k_packet_rays; first_ray += k_wide) step(first_ray);
}

struct Interval {
    float low, high;
};
[[nodiscard]] inline Interval interval_of(const PacketRays::FloatRow& row) {
    const Float8 a = load(row.data()), b = load(row.data() + k_wide);
    return {least(min(a, b)), greatest(max(a, b))};
}
[[nodiscard]] inline float farthest(const PacketRays& rays) { return interval_of(rays.t_max).high; }

/// The packet as an interval of rays, and the rays.
struct PacketBoxRay {
    struct Slab {
        Float8 near_origin, far_origin, inverse_low, inverse_high;
        std::size_t near, far;
    };
    Slab x, y, z;
    Float8 t_min;
    const PacketRays& rays;
};

/// Lowest and highest of each number over all rays.
struct PacketBounds {
    std::array<Interval, 3> origins, directions;
    float t_min;

    explicit PacketBounds(const PacketRays& rays) : t_min(interval_of(rays.t_min).low) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            origins[axis] = interval_of(rays.origin[axis]);
            directions[axis] = interval_of(rays.direction[axis]);
        }
    }
    [[nodiscard]] bool backward(std::size_t axis) const { return directions[axis].high < 0; }
    /// All directions in the inside of one octant.
    [[nodiscard]] bool coherent() const {
        for (const auto& [low, high] : directions)
            if (!(low > 0 || high < 0)) return false;
        return true;
    }
    /// The error of a box test: that of BoxRay for the ray that has the largest.
    [[nodiscard]] float error(const Box& scene) const {
        float reach = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            for (const float plane : {scene.low[int(axis)], scene.high[int(axis)]})
                for (const float end : {origins[axis].low, origins[axis].high})
                    reach = std::max(reach, std::abs(plane - end));
        return 0x1p-48f * reach;
    }
};

[[nodiscard]] inline PacketBoxRay packet_box_ray(const PacketBounds& bounds, float error,
                                                 const PacketRays& rays) {
    const auto slab = [&](std::size_t axis) {
        const bool backward = bounds.backward(axis);
        const auto moved = [&](float origin, float sign) {
            return origin + sign * (std::abs(origin) * 0x1p-22f + error);
        };
        const auto [low, high] = bounds.origins[axis];
        const std::size_t low_plane = axis * k_wide, high_plane = low_plane + 3 * k_wide;
        return PacketBoxRay::Slab{broadcast(backward ? moved(low, -1) : moved(high, 1)),
                                  broadcast(backward ? moved(high, 1) : moved(low, -1)),
                                  broadcast(1 / bounds.directions[axis].high),
                                  broadcast(1 / bounds.directions[axis].low),
                                  backward ? high_plane : low_plane,
                                  backward ? low_plane : high_plane};
    };
    return {slab(0), slab(1), slab(2), broadcast(bounds.t_min), rays};
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

/// Whether any ray meets the box, whose planes lie k_wide floats apart, before the hit that it has.
[[nodiscard]] inline bool any_ray_meets(const PacketBoxRay& ray, const float* planes) {
    const PacketRays& rays = ray.rays;
    bool met = false;
    each_eight([&](std::size_t first_ray) {
        const auto at = [&](std::size_t plane, const PacketRays::FloatRow& origin,
                            const PacketRays::FloatRow& inverse) {
            return (broadcast(planes[plane]) - load(origin.data() + first_ray)) *
                   load(inverse.data() + first_ray);
        };
        const auto near = [&](std::size_t axis, const PacketBoxRay::Slab& slab) {
            return at(slab.near, rays.near_origin[axis], rays.inverse[axis]);
        };
        const auto far = [&](std::size_t axis, const PacketBoxRay::Slab& slab) {
            return at(slab.far, rays.far_origin[axis], rays.inverse[axis]);
        };
        const Float8 t_near = max(max(near(0, ray.x), near(1, ray.y)),
                                  max(near(2, ray.z), load(rays.t_min.data() + first_ray)));
        const Float8 t_far =
            min(min(far(0, ray.x), far(1, ray.y)), min(far(2, ray.z), load(rays.t_max.data() + first_ray)));
        met |= any(at_most(t_near, t_far * broadcast(k_far_stretch)));
    });
    return met;
}

[[nodiscard]] inline Lanes intersect_children(const WideNode& node, const PacketBoxRay& ray, float t_max,
                                              Float8& t_near) {
    const float* const planes = node.bounds[0].data();
    const Lanes candidates =
        intersect_boxes(ray, t_max, t_near, [&](std::size_t which) { return load(planes + which); });
    Lanes met = candidates;
    for (Lanes left = candidates; any(left); left = without_first(left))
        if (const int child = first(left); !any_ray_meets(ray, planes + child)) met &= ~(Lanes{1} << child);
    return met;
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

/// Fills the rows of BoxRay.
inline void prepare_boxes(PacketRays& rays, const PacketBounds& bounds, float error) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const float sign = bounds.backward(axis) ? -1.0f : 1.0f;
        each_eight([&](std::size_t i) {
            const Float8 origin = load(rays.origin[axis].data() + i);
            const Float8 size = max(origin, broadcast(0.0f) - origin);
            const Float8 shift = broadcast(sign) * (size * broadcast(0x1p-22f) + broadcast(error));
            store(rays.near_origin[axis].data() + i, origin + shift);
            store(rays.far_origin[axis].data() + i, origin - shift);
            store(rays.inverse[axis].data() + i, broadcast(1.0f) / load(rays.direction[axis].data() + i));
        });
    }
}

/// Fills the rows of TriangleRay; false if the rays' longest axes differ.
[[nodiscard]] inline bool prepare_triangles(PacketRays& rays) {
    const auto longest = [&](std::size_t i) {
        const float x = std::abs(rays.direction[0][i]), y = std::abs(rays.direction[1][i]),
                    z = std::abs(rays.direction[2][i]);
        return x >= y && x >= z ? 0 : y >= z ? 1 : 2;
    };
    rays.z = longest(0);
    rays.x = rays.z == 2 ? 0 : rays.z + 1;
    rays.y = rays.x == 2 ? 0 : rays.x + 1;
    for (std::size_t i = 1; i < k_packet_rays; ++i)
        if (longest(i) != rays.z) return false;
    each_eight([&](std::size_t i) {
        const auto wide = [&](const std::array<PacketRays::FloatRow, 3>& rows, int axis) {
            return widen(load(rows[std::size_t(axis)].data() + i));
        };
        const Double8 inverse_z = broadcast(1.0) / wide(rays.direction, rays.z);
        store(rays.inverse_z.data() + i, inverse_z);
        store(rays.shear_x.data() + i, wide(rays.direction, rays.x) * inverse_z);
        store(rays.shear_y.data() + i, wide(rays.direction, rays.y) * inverse_z);
        store(rays.origin_x.data() + i, wide(rays.origin, rays.x));
        store(rays.origin_y.data() + i, wide(rays.origin, rays.y));
        store(rays.origin_z.data() + i, wide(rays.origin, rays.z));
    });
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
[[nodiscard]] inline bool walk_packet(const WideBvh& bvh, PacketRays& rays, float& t_max,
                                      OpenBlock&& open_block) {
    const PacketBounds bounds(rays);
    if (!bounds.coherent() || !prepare_triangles(rays)) return false;
    const float error = bounds.error(bvh.bounds);
    prepare_boxes(rays, bounds, error);
    t_max = farthest(rays);
    const PacketBoxRay box_ray = packet_box_ray(bounds, error, rays);
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
    PacketRays packet(rays);
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
        t_max = farthest(packet);
        return false;
    };
    if (walk_packet<true>(bvh, packet, t_max, open_block)) return;
    NullTraversalProbe probe;
    for (std::size_t i = 0; i < rays.size(); ++i) closest[i] = find_closest(bvh, rays[i], filter, probe);
}

[[nodiscard]] inline std::uint32_t find_any_packet(const WideBvh& bvh, std::span<const Ray> rays,
                                                   HitFilter filter) {
    if (bvh.empty() || rays.empty()) return 0;
    PacketRays packet(rays);
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
        t_max = farthest(packet);
        return met == (1u << rays.size()) - 1;
    };
    if (walk_packet<false>(bvh, packet, t_max, open_block)) return met;
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
