#include "smooth_normals.hpp"

#include <cmath>

#include "pathscope/scene/triangulate.hpp"

namespace pathscope {
namespace {

struct Sum {
    double x = 0, y = 0, z = 0;
};

/// The normals under way: each position heads a chain of the groups that meet there.
struct GroupNormal {
    std::uint32_t group;
    std::int32_t next;
    Sum sum;
};

class NormalSums {
  public:
    explicit NormalSums(std::size_t positions) : head_(positions, k_none) {}

    [[nodiscard]] std::int32_t find_or_add(std::int32_t position, std::uint32_t group) {
        std::int32_t& head = head_[std::size_t(position)];
        for (std::int32_t i = head; i != k_none; i = normals_[std::size_t(i)].next)
            if (normals_[std::size_t(i)].group == group) return i;
        normals_.push_back({group, head, {}});
        return head = std::int32_t(normals_.size() - 1);
    }
    void add(std::int32_t index, const PolygonNormal& unit, double weight) {
        Sum& sum = normals_[std::size_t(index)].sum;
        sum.x += unit.x * weight;
        sum.y += unit.y * weight;
        sum.z += unit.z * weight;
    }
    [[nodiscard]] const std::vector<GroupNormal>& all() const { return normals_; }

  private:
    std::vector<std::int32_t> head_;
    std::vector<GroupNormal> normals_;
};

/// The inner angle at b, up to 2 pi where the polygon turns right. Zero if two corners fall together.
double angle_at(Vec3 a, Vec3 b, Vec3 c, const PolygonNormal& normal) {
    const double u[3] = {double(a.x) - b.x, double(a.y) - b.y, double(a.z) - b.z};
    const double v[3] = {double(c.x) - b.x, double(c.y) - b.y, double(c.z) - b.z};
    const double w[3] = {v[1] * u[2] - v[2] * u[1], v[2] * u[0] - v[0] * u[2], v[0] * u[1] - v[1] * u[0]};
    const double sine = w[0] * normal.x + w[1] * normal.y + w[2] * normal.z;
    const double angle = std::atan2(sine, u[0] * v[0] + u[1] * v[1] + u[2] * v[2]);
    return angle < 0 ? angle + 2 * double(k_pi) : angle;
}

bool make_unit(double& x, double& y, double& z) {
    const double length = std::sqrt(x * x + y * y + z * z);
    if (!(length > 0)) return false;
    x /= length;
    y /= length;
    z /= length;
    return true;
}

}  // namespace

void add_smooth_normals(ObjFaces& faces) {
    NormalSums sums(faces.positions.size());
    const auto first_new = std::int32_t(faces.normals.size());
    std::vector<Vec3> polygon;
    for (std::size_t face = 0; face < faces.size(); ++face) {
        if (faces.group[face] == 0) continue;
        const std::span<ObjCorner> corners = faces.corners_of(face);
        polygon.clear();
        for (const ObjCorner& corner : corners)
            polygon.push_back(faces.positions[std::size_t(corner.position)]);
        PolygonNormal normal = polygon_normal(polygon);
        const bool has_area = make_unit(normal.x, normal.y, normal.z);

        // Faces with normals of their own take part in the mean of those that have none.
        for (std::size_t i = 0; i < corners.size(); ++i) {
            const std::int32_t at = sums.find_or_add(corners[i].position, faces.group[face]);
            const Vec3 before = polygon[(i + polygon.size() - 1) % polygon.size()];
            const Vec3 after = polygon[(i + 1) % polygon.size()];
            if (has_area) sums.add(at, normal, angle_at(before, polygon[i], after, normal));
            if (corners[i].normal == k_none) corners[i].normal = first_new + at;
        }
    }
    for (const GroupNormal& entry : sums.all()) {
        Sum n = entry.sum;
        if (!make_unit(n.x, n.y, n.z)) n = {};
        faces.normals.push_back({float(n.x), float(n.y), float(n.z)});
    }
}

}  // namespace pathscope
