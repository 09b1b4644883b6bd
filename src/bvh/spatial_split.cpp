#include "bvh/spatial_split.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "bvh/object_split.hpp"

namespace pathscope {
namespace {

constexpr int k_max_bins = 16;

/// A place along an axis: the box of all that lies in it, and how many references begin and end there.
struct Bin {
    Box box;
    std::uint32_t begin = 0, end = 0;
};

struct Planes {
    float low = 0, step = 0, scale = 0;
    int count = 0;

    Planes(const Box& bounds, int axis, int bins) : low(bounds.low[axis]), count(bins) {
        const float extent = bounds.high[axis] - low;
        step = extent / float(bins);
        scale = float(bins) / extent;
    }
    [[nodiscard]] bool usable() const {
        return step > 0 && std::isfinite(scale) && low + step > low &&
               low + step * float(count - 1) < low + step * float(count);
    }
    /// Right of bin i.
    [[nodiscard]] float plane(int i) const { return low + step * float(i + 1); }
    [[nodiscard]] int bin_of(float coordinate) const {
        return std::clamp(static_cast<int>((coordinate - low) * scale), 0, count - 1);
    }
};

/// The point where an edge crosses the plane, as a box that holds it: half an ulp of rounding, twice over.
Box crossing(Vec3 from, Vec3 to, int axis, float plane) {
    const double t = (double(plane) - double(from[axis])) / (double(to[axis]) - double(from[axis]));
    Box point;
    for (int i = 0; i < 3; ++i) {
        const double exact = double(from[i]) + t * (double(to[i]) - double(from[i]));
        const float error = float(std::abs(exact)) * 0x1p-23f + std::numeric_limits<float>::min();
        point.low[i] = float(exact) - error;
        point.high[i] = float(exact) + error;
    }
    point.low[axis] = point.high[axis] = plane;
    return point;
}

Reference clipped(const Box& part, const Reference& whole) {
    Reference result = whole;
    result.low = max(part.low, whole.low);
    result.high = min(part.high, whole.high);
    return result;
}

void chop(std::array<Bin, k_max_bins>& bins, const Mesh& mesh, const Reference& reference, int axis,
          const Planes& planes) {
    const int first = planes.bin_of(reference.low[axis]), last = planes.bin_of(reference.high[axis]);
    ++bins[std::size_t(first)].begin;
    ++bins[std::size_t(last)].end;
    Reference rest = reference;
    for (int i = first; i < last; ++i) {
        const float plane = planes.plane(i);
        if (!(plane > rest.low[axis] && plane < rest.high[axis])) continue;
        const CutReference parts = cut(mesh, rest, axis, plane);
        if (!parts.left.box().empty()) bins[std::size_t(i)].box.add(parts.left.box());
        rest = parts.right;
    }
    if (!rest.box().empty()) bins[std::size_t(last)].box.add(rest.box());
}

void improve(std::optional<SpatialSplit>& best, const std::array<Bin, k_max_bins>& bins, int axis,
             const Planes& planes) {
    std::array<double, k_max_bins> right_cost;
    std::array<std::size_t, k_max_bins> right_count;
    Box box;
    std::size_t count = 0;
    for (int i = planes.count - 1; i > 0; --i) {
        box.add(bins[std::size_t(i)].box);
        count += bins[std::size_t(i)].end;
        right_cost[std::size_t(i)] = double(box.half_area()) * blocks_of(count);
        right_count[std::size_t(i)] = count;
    }
    box = {};
    count = 0;
    for (int i = 1; i < planes.count; ++i) {
        box.add(bins[std::size_t(i) - 1].box);
        count += bins[std::size_t(i) - 1].begin;
        const std::size_t right = right_count[std::size_t(i)];
        const double cost = double(box.half_area()) * blocks_of(count) + right_cost[std::size_t(i)];
        if (count == 0 || right == 0 || !std::isfinite(cost) || (best && cost >= best->cost)) continue;
        best = SpatialSplit{axis, planes.plane(i - 1), cost, count, right};
    }
}

}  // namespace

CutReference cut(const Mesh& mesh, const Reference& reference, int axis, float plane) {
    const TriangleCorners triangle = corners(mesh, reference.triangle);
    const std::array<Vec3, 3> corner{triangle.a, triangle.b, triangle.c};
    Box left, right;
    for (std::size_t i = 0; i < 3; ++i) {
        const Vec3 from = corner[i], to = corner[(i + 1) % 3];
        if (from[axis] <= plane) left.add(from);
        if (from[axis] >= plane) right.add(from);
        if ((from[axis] < plane && to[axis] > plane) || (from[axis] > plane && to[axis] < plane)) {
            const Box point = crossing(from, to, axis, plane);
            left.add(point);
            right.add(point);
        }
    }
    left.high[axis] = std::min(left.high[axis], plane);
    right.low[axis] = std::max(right.low[axis], plane);
    return {clipped(left, reference), clipped(right, reference)};
}

std::optional<SpatialSplit> find_spatial_split(const Mesh& mesh, std::span<const Reference> references,
                                               const Box& bounds) {
    const int count = std::min<int>(k_max_bins, 4 + int(references.size() / 8));
    std::optional<SpatialSplit> best;
    for (int axis = 0; axis < 3; ++axis) {
        const Planes planes(bounds, axis, count);
        if (!planes.usable()) continue;
        std::array<Bin, k_max_bins> bins;
        for (const Reference& reference : references) chop(bins, mesh, reference, axis, planes);
        improve(best, bins, axis, planes);
    }
    return best;
}

std::size_t divide_at(const SpatialSplit& split, const Mesh& mesh, std::vector<Reference>& references,
                      std::size_t begin) {
    const int axis = split.axis;
    const float plane = split.plane;
    // Cut first: the right halves go to the end, which is the right side in any case.
    for (std::size_t i = begin, end = references.size(); i < end; ++i) {
        if (!(references[i].low[axis] < plane && references[i].high[axis] > plane)) continue;
        const CutReference parts = cut(mesh, references[i], axis, plane);
        const bool has_left = !parts.left.box().empty(), has_right = !parts.right.box().empty();
        if (has_left && has_right) references.push_back(parts.right);
        if (has_left || has_right) references[i] = has_left ? parts.left : parts.right;
    }
    const auto middle =
        std::partition(references.begin() + std::ptrdiff_t(begin), references.end(),
                       [&](const Reference& reference) { return reference.low[axis] < plane; });
    return std::size_t(middle - references.begin());
}

}  // namespace pathscope
