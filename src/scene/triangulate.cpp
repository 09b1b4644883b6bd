#include "pathscope/scene/triangulate.hpp"

#include <cmath>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

struct Point {
    double x, y;
    friend bool operator==(const Point&, const Point&) = default;
};

/// Twice the area of a, b, c; above 0 if they turn left.
double turn(Point a, Point b, Point c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

/// Along the axis that the normal is nearest to, so that the polygon is seen as large as possible, and from its
/// front, so that it runs counter-clockwise.
std::vector<Point> projected(std::span<const Vec3> corners, const PolygonNormal& normal) {
    const double x = std::abs(normal.x), y = std::abs(normal.y), z = std::abs(normal.z);
    std::vector<Point> points;
    points.reserve(corners.size());
    for (const Vec3& p : corners) {
        if (z >= x && z >= y)
            points.push_back(normal.z > 0 ? Point{p.x, p.y} : Point{p.y, p.x});
        else if (y >= x)
            points.push_back(normal.y > 0 ? Point{p.z, p.x} : Point{p.x, p.z});
        else
            points.push_back(normal.x > 0 ? Point{p.y, p.z} : Point{p.z, p.y});
    }
    return points;
}

double squared_distance(Vec3 a, Vec3 b) {
    const double x = double(a.x) - b.x, y = double(a.y) - b.y, z = double(a.z) - b.z;
    return x * x + y * y + z * z;
}

/// Both diagonals of a convex quad lie inside; of one that is not, only that from the corner which turns right.
void cut_quad(std::span<const Vec3> corners, const std::vector<Point>& p,
              std::vector<std::uint32_t>& triangles) {
    const bool cuts_02 = turn(p[0], p[1], p[2]) > 0 && turn(p[0], p[2], p[3]) > 0;
    const bool cuts_13 = turn(p[0], p[1], p[3]) > 0 && turn(p[1], p[2], p[3]) > 0;
    const bool shorter_02 =
        squared_distance(corners[0], corners[2]) <= squared_distance(corners[1], corners[3]);
    if (cuts_02 == cuts_13 ? shorter_02 : cuts_02)
        triangles.insert(triangles.end(), {0, 1, 2, 0, 2, 3});
    else
        triangles.insert(triangles.end(), {0, 1, 3, 1, 2, 3});
}

/// The polygon that is left, as a ring of corners.
class EarClipper {
  public:
    explicit EarClipper(const std::vector<Point>& points) : points_(points) {
        const auto count = std::uint32_t(points.size());
        for (std::uint32_t i = 0; i < count; ++i) ring_.push_back({(i + count - 1) % count, (i + 1) % count});
        for (std::uint32_t i = 0; i < count; ++i)
            if (turn_at(i) <= 0) not_left_.push_back(i);
    }

    /// Corners that all turn left need no search. Else, from ears that stand clear of all other corners to mere
    /// left turns, so that degenerate polygons end too: what has no ear of one kind is cut by the next.
    void run(std::vector<std::uint32_t>& triangles) {
        std::uint32_t corner = 0;
        for (std::size_t left = points_.size(); left > 2; --left) {
            corner = find_ear(corner, left);
            const Link link = ring_[corner];
            triangles.insert(triangles.end(), {link.before, corner, link.after});
            ring_[link.before].after = link.after;
            ring_[link.after].before = link.before;
            ring_[corner] = {corner, corner};
            corner = link.after;
        }
    }

  private:
    struct Link {
        std::uint32_t before, after;
    };
    enum class Clearance { touches_nothing, holds_nothing, turns_left };

    [[nodiscard]] double turn_at(std::uint32_t i) const {
        return turn(points_[ring_[i].before], points_[i], points_[ring_[i].after]);
    }

    [[nodiscard]] std::uint32_t find_ear(std::uint32_t start, std::size_t left) {
        std::erase_if(not_left_, [this](std::uint32_t i) { return ring_[i].after == i || turn_at(i) > 0; });
        for (const Clearance clearance :
             {Clearance::touches_nothing, Clearance::holds_nothing, Clearance::turns_left}) {
            std::uint32_t corner = start;
            for (std::size_t i = 0; i < left; ++i, corner = ring_[corner].after)
                if (is_ear(corner, clearance)) return corner;
        }
        return start;
    }

    /// Only corners that do not turn left can lie in an ear: if any does, one of those does.
    [[nodiscard]] bool is_ear(std::uint32_t corner, Clearance clearance) const {
        if (!(turn_at(corner) > 0)) return false;
        if (clearance == Clearance::turns_left) return true;
        const Point a = points_[ring_[corner].before], b = points_[corner], c = points_[ring_[corner].after];
        for (const std::uint32_t other : not_left_) {
            const Point p = points_[other];
            if (p == a || p == b || p == c) continue;
            const double ab = turn(a, b, p), bc = turn(b, c, p), ca = turn(c, a, p);
            const bool inside = clearance == Clearance::touches_nothing ? ab >= 0 && bc >= 0 && ca >= 0
                                                                        : ab > 0 && bc > 0 && ca > 0;
            if (inside) return false;
        }
        return true;
    }

    const std::vector<Point>& points_;
    std::vector<Link> ring_;
    std::vector<std::uint32_t> not_left_;
};

}  // namespace

PolygonNormal polygon_normal(std::span<const Vec3> corners) {
    PolygonNormal normal;
    const Vec3 origin = corners[0];
    const auto from_origin = [&](Vec3 p) {
        return PolygonNormal{double(p.x) - origin.x, double(p.y) - origin.y, double(p.z) - origin.z};
    };
    PolygonNormal a = from_origin(corners[1]);
    for (std::size_t i = 2; i < corners.size(); ++i) {
        const PolygonNormal b = from_origin(corners[i]);
        normal.x += a.y * b.z - a.z * b.y;
        normal.y += a.z * b.x - a.x * b.z;
        normal.z += a.x * b.y - a.y * b.x;
        a = b;
    }
    return normal;
}

void triangulate(std::span<const Vec3> corners, std::vector<std::uint32_t>& triangles) {
    CHECK(corners.size() >= 3, corners.size());
    if (corners.size() == 3) {
        triangles.insert(triangles.end(), {0, 1, 2});
        return;
    }
    const std::vector<Point> points = projected(corners, polygon_normal(corners));
    if (corners.size() == 4) return cut_quad(corners, points, triangles);
    EarClipper(points).run(triangles);
}

}  // namespace pathscope
