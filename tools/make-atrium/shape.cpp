#include "shape.hpp"

#include <cmath>

#include "pathscope/core/check.hpp"
#include "pathscope/math/frame.hpp"

namespace pathscope::atrium {
namespace {

/// A strip between two rows of equally many vertices; seen from outside, rows run to the right, the lower
/// one below.
void join_rows(Shape& to, std::uint32_t lower, std::uint32_t upper, std::uint32_t count) {
    for (std::uint32_t i = 0; i + 1 < count; ++i) {
        to.triangles.push_back({lower + i, lower + i + 1, upper + i + 1});
        to.triangles.push_back({lower + i, upper + i + 1, upper + i});
    }
}

void drop_degenerate(Shape& shape) {
    std::erase_if(shape.triangles, [&](const auto& t) {
        const Vec3 a = shape.vertices[t[0]].position;
        const Vec3 normal = cross(shape.vertices[t[1]].position - a, shape.vertices[t[2]].position - a);
        return length_squared(normal) < 1e-16f;
    });
}

Vec2 planar_uv(Vec3 p, Vec3 normal) {
    const Vec3 n = abs(normal);
    if (n.y >= n.x && n.y >= n.z) return {p.x, p.z};
    return n.x >= n.z ? Vec2{p.z, p.y} : Vec2{p.x, p.y};
}

/// A quad strip whose rows are the points of a profile, each led along a path; flat across, smooth along.
/// Seen from outside, the path runs to the right and the profile upwards.
Shape swept(int edges, int steps, float path_length, const std::function<Vec3(int, int)>& point,
            const std::function<Vec3(int, int)>& edge_normal) {
    Shape shape;
    float across = 0;
    for (int edge = 0; edge < edges; ++edge) {
        const float width = length(point(edge + 1, 0) - point(edge, 0));
        const auto first = std::uint32_t(shape.vertices.size());
        for (int end = 0; end < 2; ++end)
            for (int step = 0; step <= steps; ++step)
                shape.vertices.push_back(
                    {point(edge + end, step),
                     edge_normal(edge, step),
                     {path_length * float(step) / float(steps), across + float(end) * width}});
        across += width;
        join_rows(shape, first, first + steps + 1, steps + 1);
    }
    return shape;
}

}  // namespace

Vec3 turned(Vec3 v, float angle) {
    const float c = std::cos(angle), s = std::sin(angle);
    return {c * v.x + s * v.z, v.y, c * v.z - s * v.x};
}

void append(Shape& to, const Shape& shape, const Placement& place) {
    const auto first = std::uint32_t(to.vertices.size());
    for (const Vertex& v : shape.vertices)
        to.vertices.push_back({turned(v.position * place.scale, place.turn) + place.origin,
                               normalize(turned(v.normal / place.scale, place.turn)), v.uv});
    for (const auto& t : shape.triangles) to.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

void add_polygon(Shape& to, const std::vector<Vec3>& corners, Vec3 normal) {
    CHECK(corners.size() >= 3, corners.size());
    const Vec3 by_winding = cross(corners[1] - corners[0], corners[2] - corners[0]);
    const bool flip = dot(by_winding, normal) < 0;
    const auto first = std::uint32_t(to.vertices.size());
    for (const Vec3 p : corners) to.vertices.push_back({p, normal, planar_uv(p, normal)});
    for (std::uint32_t i = 1; i + 1 < corners.size(); ++i)
        to.triangles.push_back({first, first + (flip ? i + 1 : i), first + (flip ? i : i + 1)});
}

Shape sheet(int columns, int rows, Vec2 uv_size, const std::function<Vec3(float, float)>& point) {
    constexpr float step = 1e-3f;
    Shape shape;
    for (int row = 0; row <= rows; ++row) {
        for (int column = 0; column <= columns; ++column) {
            const float u = float(column) / float(columns), v = float(row) / float(rows);
            const Vec3 along_u = point(u + step, v) - point(u - step, v);
            const Vec3 along_v = point(u, v + step) - point(u, v - step);
            shape.vertices.push_back(
                {point(u, v), normalize(cross(along_u, along_v)), {u * uv_size.x, v * uv_size.y}});
        }
        if (row > 0) join_rows(shape, (row - 1) * (columns + 1), row * (columns + 1), columns + 1);
    }
    return shape;
}

Shape box(Vec3 low, Vec3 high, float bevel) {
    const Vec3 centre = 0.5f * (low + high), half = 0.5f * (high - low);
    // The corner in octant `sign` as seen by the face across `axis`: pulled in by the bevel along the others.
    const auto corner = [&](Vec3 sign, int axis) {
        Vec3 p = half - Vec3{bevel, bevel, bevel};
        p[axis] = half[axis];
        return centre + sign * p;
    };
    Shape shape;
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        for (const float sa : {-1.0f, 1.0f}) {
            const auto sign = [&](float sb, float sc) {
                Vec3 s;
                s[a] = sa, s[b] = sb, s[c] = sc;
                return s;
            };
            Vec3 normal;
            normal[a] = sa;
            add_polygon(shape,
                        {corner(sign(-1, -1), a), corner(sign(1, -1), a), corner(sign(1, 1), a),
                         corner(sign(-1, 1), a)},
                        normal);
            if (bevel == 0) continue;
            for (const float sb : {-1.0f, 1.0f}) {
                Vec3 edge_normal;
                edge_normal[a] = sa, edge_normal[b] = sb;
                add_polygon(shape,
                            {corner(sign(sb, -1), a), corner(sign(sb, 1), a), corner(sign(sb, 1), b),
                             corner(sign(sb, -1), b)},
                            normalize(edge_normal));
                if (a != 0) continue;
                for (const float sc : {-1.0f, 1.0f})
                    add_polygon(shape,
                                {corner(sign(sb, sc), 0), corner(sign(sb, sc), 1), corner(sign(sb, sc), 2)},
                                normalize(Vec3{sa, sb, sc}));
            }
        }
    }
    return shape;
}

Shape lathe(const std::vector<ProfilePoint>& profile, int segments) {
    constexpr float k_cos_sharp = 0.866f;
    const int edges = int(profile.size()) - 1;
    const auto outward = [&](int edge) {
        const float dr = profile[edge + 1].radius - profile[edge].radius;
        const float dy = profile[edge + 1].height - profile[edge].height;
        return normalize(Vec3{dy, -dr, 0});
    };
    const auto normal_at = [&](int edge, int neighbour) {
        const Vec3 own = outward(edge);
        if (neighbour < 0 || neighbour >= edges) return own;
        const Vec3 other = outward(neighbour);
        return dot(own, other) < k_cos_sharp ? own : normalize(own + other);
    };
    float widest = 0;
    for (const ProfilePoint p : profile) widest = std::max(widest, p.radius);

    Shape shape;
    float height = 0;
    for (int edge = 0; edge < edges; ++edge) {
        const auto first = std::uint32_t(shape.vertices.size());
        for (int end = 0; end < 2; ++end) {
            const ProfilePoint p = profile[edge + end];
            const Vec3 normal = normal_at(edge, end == 0 ? edge - 1 : edge + 1);
            for (int i = 0; i <= segments; ++i) {
                const float part = float(i) / float(segments), angle = 2 * k_pi * part;
                shape.vertices.push_back({turned({0, p.height, p.radius}, angle),
                                          turned({0, normal.y, normal.x}, angle),
                                          {2 * k_pi * widest * part, height}});
            }
            if (end == 0)
                height +=
                    std::hypot(profile[edge + 1].radius - p.radius, profile[edge + 1].height - p.height);
        }
        join_rows(shape, first, first + segments + 1, segments + 1);
    }
    drop_degenerate(shape);
    return shape;
}

Shape ball(float radius, int segments) {
    std::vector<ProfilePoint> profile;
    for (int i = 0; i <= segments / 2; ++i) {
        const float angle = 2 * k_pi * float(i) / float(segments);
        profile.push_back({radius * std::sin(angle), -radius * std::cos(angle)});
    }
    profile.front().radius = profile.back().radius = 0;
    Shape shape = lathe(profile, segments);
    for (Vertex& v : shape.vertices) v.normal = normalize(v.position);
    return shape;
}

Shape arch_wall(const ArchSize& size, int segments) {
    const float half = size.width / 2, z = size.depth / 2;
    // Angles of the half circle, with those that point at the wall's upper corners among them.
    const float corner = std::atan2(size.height, half);
    std::vector<float> angles{corner, k_pi - corner};
    for (int i = 0; i <= segments; ++i) angles.push_back(k_pi * float(i) / float(segments));
    std::sort(angles.begin(), angles.end());

    const auto inner = [&](float angle) {
        return Vec3{size.radius * std::cos(angle), size.radius * std::sin(angle), 0};
    };
    const auto outer = [&](float angle) {
        const Vec3 d{std::cos(angle), std::sin(angle), 0};
        return d * std::min(half / std::max(std::abs(d.x), 1e-6f), size.height / std::max(d.y, 1e-6f));
    };
    Shape shape;
    for (std::size_t i = 0; i + 1 < angles.size(); ++i) {
        const float a = angles[i], b = angles[i + 1];
        for (const float side : {-z, z}) {
            const Vec3 shift{0, 0, side};
            add_polygon(shape, {inner(a) + shift, outer(a) + shift, outer(b) + shift, inner(b) + shift},
                        {0, 0, side > 0 ? 1.0f : -1.0f});
        }
    }
    for (const float side : {-1.0f, 1.0f})
        add_polygon(shape,
                    {{side * size.radius, 0, -z},
                     {side * half, 0, -z},
                     {side * half, 0, z},
                     {side * size.radius, 0, z}},
                    {0, -1, 0});
    const float arc = k_pi * size.radius;
    append(shape,
           swept(
               1, segments, arc,
               [&](int end, int step) {
                   return inner(k_pi * float(step) / float(segments)) + Vec3{0, 0, end == 0 ? z : -z};
               },
               [&](int, int step) { return -normalize(inner(k_pi * float(step) / float(segments))); }));
    return shape;
}

Shape arch_moulding(float radius, const std::vector<Vec2>& profile, int segments) {
    const auto angle = [&](int step) { return k_pi * (1 - float(step) / float(segments)); };
    return swept(
        int(profile.size()) - 1, segments, k_pi * radius,
        [&](int i, int step) {
            const float r = radius + profile[i].x, a = angle(step);
            return Vec3{r * std::cos(a), r * std::sin(a), profile[i].y};
        },
        [&](int edge, int step) {
            const Vec2 along = profile[edge + 1] - profile[edge];
            const Vec3 n = normalize(Vec3{-along.y, 0, along.x});
            return Vec3{n.x * std::cos(angle(step)), n.x * std::sin(angle(step)), n.z};
        });
}

Shape inner_moulding(float half_x, float half_z, const std::vector<Vec2>& profile) {
    Shape shape;
    for (int side = 0; side < 4; ++side) {
        const Vec3 inward = turned({0, 0, -1}, 0.5f * k_pi * float(side));
        const Vec3 along = cross(Vec3{0, 1, 0}, inward);
        const float reach = side % 2 == 0 ? half_z : half_x, half = side % 2 == 0 ? half_x : half_z;
        for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
            const auto end = [&](Vec2 p, float sign) {
                return (p.x - reach) * inward + Vec3{0, p.y, 0} + sign * (half - p.x) * along;
            };
            const Vec2 step = profile[i + 1] - profile[i];
            const Vec3 normal = normalize(step.y * inward - Vec3{0, step.x, 0});
            add_polygon(
                shape,
                {end(profile[i], -1), end(profile[i], 1), end(profile[i + 1], 1), end(profile[i + 1], -1)},
                normal);
        }
    }
    return shape;
}

Shape groin_vault(float size_x, float size_z, float rise, int segments) {
    Shape shape;
    for (int web = 0; web < 4; ++web) {
        // In the web's own frame its barrel runs along x, from the crossing (a = 0) to the bay's edge (a = 1).
        const float half = 0.5f * (web % 2 == 0 ? size_x : size_z),
                    half_across = 0.5f * (web % 2 == 0 ? size_z : size_x);
        Shape own;
        for (int row = 0; row <= segments; ++row) {
            const float t = -std::cos(k_pi * float(row) / float(segments));  // rows gather where it is steep
            const float height = std::sqrt(std::max(0.0f, 1 - t * t));
            const Vec3 normal = normalize(Vec3{0, -height, -rise * t / half_across});
            for (int column = 0; column <= segments / 2; ++column) {
                const float a = lerp(std::abs(t), 1.0f, 2 * float(column) / float(segments));
                own.vertices.push_back(
                    {{a * half, rise * height, t * half_across}, normal, {a * half, t * half_across * 1.4f}});
            }
            const std::uint32_t width = segments / 2 + 1;
            if (row > 0) join_rows(own, (row - 1) * width, row * width, width);
        }
        drop_degenerate(own);
        append(shape, own, {.turn = 0.5f * k_pi * float(web)});
    }
    return shape;
}

void add_card(Shape& to, Vec3 centre, Vec3 right, Vec3 up) {
    const auto first = std::uint32_t(to.vertices.size());
    const Vec3 normal = normalize(cross(right, up));
    for (const Vec2 at : {Vec2{0, 0}, Vec2{1, 0}, Vec2{1, 1}, Vec2{0, 1}})
        to.vertices.push_back({centre + (at.x - 0.5f) * right + (at.y - 0.5f) * up, normal, at});
    to.triangles.push_back({first, first + 1, first + 2});
    to.triangles.push_back({first, first + 2, first + 3});
}

Shape closed_tube(const std::function<Vec3(float)>& curve, float radius, int steps, int segments) {
    // The curve's own frame: well defined for curves that bend everywhere, as knots do.
    const auto point = [&](float t, float angle) {
        constexpr float h = 1e-2f;
        const Vec3 here = curve(t), forward = curve(t + h) - curve(t - h);
        const Vec3 bend = curve(t + h) + curve(t - h) - 2 * here;
        const Vec3 side = normalize(cross(forward, bend)), out = normalize(cross(side, forward));
        return here + radius * (std::cos(angle) * side + std::sin(angle) * out);
    };
    return sheet(steps, segments, {8, 1}, [&](float u, float v) { return point(u, 2 * k_pi * v); });
}

}  // namespace pathscope::atrium
