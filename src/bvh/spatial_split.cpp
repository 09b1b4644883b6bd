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
    WideBox box;
    std::uint32_t begin = 0, end = 0;
};
using Bins = std::array<Bin, k_max_bins>;

/// The corners of a triangle, and each again as its coordinates one by one.
struct CutTriangle {
    std::array<Float4, 3> corner;
    std::array<Vec3, 3> coordinates;

    CutTriangle(const Mesh& mesh, std::uint32_t triangle) {
        const TriangleCorners t = corners(mesh, triangle);
        coordinates = {t.a, t.b, t.c};
        for (std::size_t i = 0; i < 3; ++i) {
            const Vec3 c = coordinates[i];
            alignas(16) const std::array<float, 4> four{c.x, c.y, c.z, 0};
            corner[i] = load4(four.data());
        }
    }
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

/// The point where an edge crosses the plane, as a box that holds it. Rounding: 5 * 2^-24 of the edge, three by its share t, one by
/// itself and one by the product, of which 8 are taken; and 2 * 2^-24 of the point, by two sums, of which 4 are taken.
WideBox crossing(Float4 from, Float4 to, float t) {
    const Float4 edge = to - from;
    const Float4 point = from + edge * broadcast4(t);
    const Float4 error = magnitude(edge) * broadcast4(0x1p-21f) + magnitude(point) * broadcast4(0x1p-22f) +
                         broadcast4(std::numeric_limits<float>::min());
    return {point - error, point + error};
}

struct CutBoxes {
    WideBox left, right;
};

/// The boxes of what the triangle has in `whole` on both sides of the plane; empty where that is nothing.
CutBoxes cut(const CutTriangle& triangle, const WideBox& whole, int axis, float plane) {
    CutBoxes boxes;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        const float from = triangle.coordinates[i][axis], to = triangle.coordinates[j][axis];
        if (from <= plane) boxes.left.add(triangle.corner[i]);
        if (from >= plane) boxes.right.add(triangle.corner[i]);
        if ((from < plane && to > plane) || (from > plane && to < plane)) {
            const WideBox point =
                crossing(triangle.corner[i], triangle.corner[j], (plane - from) / (to - from));
            boxes.left.add(point);
            boxes.right.add(point);
        }
    }
    const auto limit = [axis](float along, float others) {
        alignas(16) std::array<float, 4> four{others, others, others, others};
        four[std::size_t(axis)] = along;
        return load4(four.data());
    };
    boxes.left.high = min(boxes.left.high, limit(plane, k_infinity));
    boxes.right.low = max(boxes.right.low, limit(plane, -k_infinity));
    for (WideBox* box : {&boxes.left, &boxes.right}) {
        box->low = max(box->low, whole.low);
        box->high = min(box->high, whole.high);
    }
    return boxes;
}

Reference reference_to(const WideBox& box, std::uint32_t triangle) {
    const Box narrow = box.box();
    return {narrow.low, triangle, narrow.high, 0};
}

void chop(Bins& bins, const CutTriangle& triangle, const Reference& reference, int axis,
          const Planes& planes) {
    const int first = planes.bin_of(reference.low[axis]), last = planes.bin_of(reference.high[axis]);
    ++bins[std::size_t(first)].begin;
    ++bins[std::size_t(last)].end;
    WideBox rest = box_of(reference);
    for (int i = first; i < last; ++i) {
        const float plane = planes.plane(i);
        const Box box = rest.box();
        if (!(plane > box.low[axis] && plane < box.high[axis])) continue;
        const CutBoxes parts = cut(triangle, rest, axis, plane);
        if (!parts.left.empty()) bins[std::size_t(i)].box.add(parts.left);
        rest = parts.right;
    }
    if (!rest.empty()) bins[std::size_t(last)].box.add(rest);
}

void improve(std::optional<SpatialSplit>& best, const Bins& bins, int axis, const Planes& planes) {
    std::array<double, k_max_bins> right_cost;
    std::array<std::size_t, k_max_bins> right_count;
    WideBox box;
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
    const CutBoxes boxes = cut(CutTriangle(mesh, reference.triangle), box_of(reference), axis, plane);
    return {reference_to(boxes.left, reference.triangle), reference_to(boxes.right, reference.triangle)};
}

std::optional<SpatialSplit> find_spatial_split(const Mesh& mesh, std::span<const Reference> references,
                                               const Box& bounds) {
    const int count = std::min<int>(k_max_bins, 4 + int(references.size() / 8));
    const std::array planes{Planes(bounds, 0, count), Planes(bounds, 1, count), Planes(bounds, 2, count)};
    std::array<Bins, 3> bins;
    for (const Reference& reference : references) {
        const CutTriangle triangle(mesh, reference.triangle);
        for (std::size_t axis = 0; axis < 3; ++axis)
            if (planes[axis].usable()) chop(bins[axis], triangle, reference, int(axis), planes[axis]);
    }
    std::optional<SpatialSplit> best;
    for (std::size_t axis = 0; axis < 3; ++axis)
        if (planes[axis].usable()) improve(best, bins[axis], int(axis), planes[axis]);
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
