#include "pathscope/geometry/sphere.hpp"

#include "pathscope/geometry/double_vec.hpp"

namespace pathscope {
namespace {

bool in_interval(const Ray& ray, double t) { return float(t) >= ray.t_min && float(t) <= ray.t_max; }

/// The hit at t, where `from_centre` is the vector from the centre to the hit, about as long as the radius.
SphereHit make_hit(double t, DoubleVec from_centre, Vec3 centre, float radius) {
    const DoubleVec normal = 1 / length(from_centre) * from_centre;
    const Vec3 position = to_float(to_double(centre) + radius * normal);
    return {float(t), position, sphere_point_error(position, radius), to_float(normal)};
}

}  // namespace

std::optional<SphereHit> intersect_sphere(const Ray& ray, Vec3 centre, float radius) {
    const DoubleVec f = to_double(ray.origin) - to_double(centre);
    const DoubleVec d = to_double(ray.direction);
    const double r_squared = double(radius) * radius;

    const double a = dot(d, d);
    const double b = -dot(f, d);
    const DoubleVec centre_to_ray = f + b / a * d;
    const double discriminant = r_squared - dot(centre_to_ray, centre_to_ray);
    if (!(discriminant >= 0)) return std::nullopt;

    const double q = b + std::copysign(std::sqrt(a * discriminant), b);
    const double c_over_q = (dot(f, f) - r_squared) / q;
    const double q_over_a = q / a;
    for (const double t : {std::min(c_over_q, q_over_a), std::max(c_over_q, q_over_a)})
        if (in_interval(ray, t)) return make_hit(t, f + t * d, centre, radius);
    return std::nullopt;
}

Vec3 sphere_point_error(Vec3 position, float radius) {
    const float rounding_in_double = 0x1p-32f * radius;
    return abs(position) * 0x1p-24f + Vec3{rounding_in_double, rounding_in_double, rounding_in_double};
}

}  // namespace pathscope
