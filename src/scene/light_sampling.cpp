#include "pathscope/scene/light_sampling.hpp"

#include <algorithm>
#include <array>

#include "lookup.hpp"
#include "pathscope/math/frame.hpp"
#include "pathscope/sampling/spherical_triangle.hpp"
#include "pathscope/sampling/warp.hpp"

namespace pathscope {
namespace {

/// What all kinds of light need to know to be sampled.
struct Request {
    const Scene& scene;
    LightSampling sampling;
    const LightReference& reference;
    std::uint32_t light;  ///< That was picked.
    float pick_probability;
    Vec2 u;
};

/// From the reference to a point of a surface.
struct Connection {
    Vec3 direction;
    float distance;

    Connection(const LightReference& reference, Vec3 position) {
        const Vec3 to_light = position - reference.position;
        distance = length(to_light);
        direction = to_light / distance;
    }
    [[nodiscard]] bool valid() const { return distance > 0 && std::isfinite(distance); }
    [[nodiscard]] float to_solid_angle(float pdf_area, Vec3 normal) const {
        const float cosine = std::abs(dot(normal, direction));
        return cosine > 0 ? pdf_area * distance * distance / cosine : 0;
    }
};

/// A sample that carries light, or nothing.
std::optional<LightSample> unless_dark(const Request& request, LightSample sample) {
    if (is_zero(sample.radiance) || !(sample.pdf_solid_angle > 0)) return std::nullopt;
    sample.light = request.light;
    return sample;
}

// ---- Surfaces.

/// Solid angles that are sampled: of triangles seen edge-on, and from their own plane, too few digits are left.
constexpr float k_least_solid_angle = 1e-4f, k_most_solid_angle = 6.28f;

/// A light as a near point sees it: its triangles, and the solid angle of both.
struct SeenLight {
    std::array<SphericalTriangle, 2> triangles;  ///< The second of a quad only.
    float solid_angle;
    float first_share;  ///< Of the first triangle in the solid angle.
};

/// Apart from the test below, which most of the time ends the matter.
[[gnu::noinline]] std::optional<SeenLight> see_near_light(const TriangleLight& light, Vec3 position) {
    std::optional<SeenLight> seen;
    const auto see = [&](const TriangleCorners& t) { return see_triangle(position, t.a, t.b, t.c); };
    const SphericalTriangle first = see(light.corners[0]);
    const SphericalTriangle second = light.is_quad() ? see(light.corners[1]) : SphericalTriangle{};
    const float of_first = first.solid_angle(), solid_angle = of_first + second.solid_angle();
    if (solid_angle > k_least_solid_angle && solid_angle < k_most_solid_angle)
        seen.emplace(SeenLight{{first, second}, solid_angle, of_first / solid_angle});
    return seen;
}

/// The light as the reference sees it, if it is sampled by solid angle. Density and sampling both ask here, so that they
/// agree.
std::optional<SeenLight> seen_from_near(LightSampling sampling, const LightReference& reference,
                                        const TriangleLight& light) {
    const bool near =
        length_squared(light.centre - reference.position) < light.longest_side * light.longest_side;
    if (!near || sampling == LightSampling::area) return std::nullopt;
    return see_near_light(light, reference.position);
}

float triangle_pdf(const std::optional<SeenLight>& seen, const Connection& to_light,
                   const TriangleLight& light, Vec3 normal) {
    return seen ? 1 / seen->solid_angle : to_light.to_solid_angle(sample_triangle_pdf(light.area), normal);
}

/// A point of one of the light's triangles. u.x chooses which, and is stretched to serve again.
struct PointOnTriangles {
    std::size_t triangle;
    Vec2 weights;  ///< Of its second and third corner.
};
PointOnTriangles sample_triangles(const TriangleLight& light, const std::optional<SeenLight>& seen, Vec2 u) {
    const float share = seen ? seen->first_share : light.first_share;
    const bool second = u.x >= share;
    u.x = (u.x - (second ? share : 0)) / (second ? 1 - share : share);
    u.x = std::min(u.x, k_one_minus_epsilon);
    const std::size_t triangle = second;
    return {triangle, seen ? sample_spherical_triangle(seen->triangles[triangle], u) : sample_triangle(u)};
}

std::optional<LightSample> sample(const Request& request, const TriangleLight& light) {
    std::optional<LightSample>
        sample;  // The only thing returned, so that it is made where the caller wants it.
    const std::optional<SeenLight> seen = seen_from_near(request.sampling, request.reference, light);
    const auto [triangle, weights] = sample_triangles(light, seen, request.u);
    LightSample& filled = sample.emplace();
    RayTarget& target = filled.target;
    if (light.even) {
        target.position = exact_point(light.corners[triangle], weights.x, weights.y);
        target.position_error = position_error(target.position, request.scene.mesh.longest_side);
        target.normal = light.normal;
        filled.radiance = light.mean_radiance;
    } else {
        const SurfacePoint point =
            surface_point(request.scene.mesh,
                          {0, weights.x, weights.y, triangle == 0 ? light.triangle : light.second_triangle});
        target = {point.position, point.position_error, point.geometric_normal};
        filled.radiance = emission_at(request.scene, point, request.reference.position - point.position);
    }
    const Connection to_light(request.reference, target.position);
    filled.direction = to_light.direction;
    filled.distance = to_light.distance;
    filled.pdf_solid_angle = request.pick_probability * triangle_pdf(seen, to_light, light, target.normal);
    filled.light = request.light;
    const bool faces_reference = light.two_sided || dot(target.normal, to_light.direction) < 0;
    const bool arrives = to_light.valid() && faces_reference && filled.pdf_solid_angle > 0;
    if (!arrives || is_zero(filled.radiance)) sample.reset();
    return sample;
}

float sphere_area_pdf(float radius) { return k_inv_pi / (4 * radius * radius); }

/// The cone of directions in which a sphere appears; nothing from inside.
struct SphereCone {
    Vec3 axis;
    float one_minus_cos;
};
std::optional<SphereCone> cone_of(const Sphere& sphere, const LightReference& reference) {
    const Vec3 to_centre = sphere.centre - reference.position;
    const float distance_squared = length_squared(to_centre), radius_squared = sphere.radius * sphere.radius;
    if (!(distance_squared > radius_squared)) return std::nullopt;
    return SphereCone{normalize(to_centre), one_minus_cos_from_sin2(radius_squared / distance_squared)};
}

std::optional<LightSample> sample_sphere_area(const Request& request, const SphereLight& light,
                                              const Sphere& sphere) {
    // In double until the last step, as sphere_point_error() demands.
    const Vec3 normal = sample_uniform_sphere(request.u);
    const double scale =
        double(sphere.radius) /
        std::sqrt(double(normal.x) * normal.x + double(normal.y) * normal.y + double(normal.z) * normal.z);
    const Vec3 position{float(sphere.centre.x + scale * normal.x), float(sphere.centre.y + scale * normal.y),
                        float(sphere.centre.z + scale * normal.z)};
    const Connection to_light(request.reference, position);
    if (!to_light.valid() || dot(normal, to_light.direction) >= 0) return std::nullopt;

    LightSample sample;
    sample.direction = to_light.direction;
    sample.distance = to_light.distance;
    sample.target = {position, sphere_point_error(position, sphere.radius), normal};
    sample.radiance = light.radiance;
    sample.pdf_solid_angle =
        request.pick_probability * to_light.to_solid_angle(sphere_area_pdf(sphere.radius), normal);
    return unless_dark(request, sample);
}

std::optional<LightSample> sample_sphere_cone(const Request& request, const SphereLight& light,
                                              const Sphere& sphere) {
    const auto cone = cone_of(sphere, request.reference);
    if (!cone) return std::nullopt;
    const Vec3 direction = Frame::around(cone->axis).to_world(sample_cone(request.u, cone->one_minus_cos));
    // By rounding, a direction at the rim may miss.
    const auto hit = intersect_sphere({request.reference.position, direction}, sphere.centre, sphere.radius);
    if (!hit) return std::nullopt;

    LightSample sample;
    sample.direction = direction;
    sample.distance = hit->t;
    sample.target = {hit->position, hit->position_error, hit->normal};
    sample.radiance = light.radiance;
    sample.pdf_solid_angle = request.pick_probability * sample_cone_pdf(cone->one_minus_cos);
    return unless_dark(request, sample);
}

std::optional<LightSample> sample(const Request& request, const SphereLight& light) {
    const Sphere& sphere = request.scene.spheres[light.sphere];
    return request.sampling == LightSampling::area ? sample_sphere_area(request, light, sphere)
                                                   : sample_sphere_cone(request, light, sphere);
}

float sphere_pdf(LightSampling sampling, const LightReference& reference, const Connection& to_light,
                 const Sphere& sphere, Vec3 normal) {
    if (sampling == LightSampling::area)
        return to_light.to_solid_angle(sphere_area_pdf(sphere.radius), normal);
    const auto cone = cone_of(sphere, reference);
    return cone ? sample_cone_pdf(cone->one_minus_cos) : 0;
}

// ---- Deltas.

std::optional<LightSample> sample(const Request& request, const PointLight& light) {
    const Connection to_light(request.reference, light.position);
    if (!to_light.valid()) return std::nullopt;
    LightSample sample;
    sample.direction = to_light.direction;
    sample.distance = to_light.distance;
    sample.target.position = light.position;
    sample.radiance = light.intensity / (to_light.distance * to_light.distance);
    sample.pdf_solid_angle = request.pick_probability;
    sample.delta = true;
    return unless_dark(request, sample);
}

std::optional<LightSample> sample_delta_sun(const Request& request, const SunLight& light) {
    LightSample sample;
    sample.direction = light.to_sun;
    sample.radiance = light.irradiance;
    sample.pdf_solid_angle = request.pick_probability;
    sample.delta = true;
    return unless_dark(request, sample);
}

// ---- Infinity.

/// A direction drawn from one of the lights at infinity, with the radiance and the density of all of them.
std::optional<LightSample> complete(const Request& request, Vec3 direction) {
    LightSample sample;
    sample.direction = direction;
    sample.radiance = environment_radiance(request.scene, direction);
    sample.pdf_solid_angle =
        sample_environment_pdf(request.scene, request.sampling, request.reference, direction);
    return unless_dark(request, sample);
}

std::optional<LightSample> sample(const Request& request, const SunLight& light) {
    if (light.is_delta()) return sample_delta_sun(request, light);
    return complete(request,
                    Frame::around(light.to_sun).to_world(sample_cone(request.u, light.one_minus_cos)));
}

std::optional<LightSample> sample(const Request& request, const SkyLight&) {
    return complete(request,
                    Frame::around(request.reference.normal).to_world(sample_cosine_hemisphere(request.u)));
}

std::optional<LightSample> sample(const Request& request, const EnvironmentLight& light) {
    return complete(request, sample_environment_map(request.scene.lights.environments[light.map], request.u));
}

float direction_pdf(const Scene& scene, const Light& light, const LightReference& reference, Vec3 direction) {
    if (const auto* sun = std::get_if<SunLight>(&light))
        return sun_covers(*sun, direction) ? sample_cone_pdf(sun->one_minus_cos) : 0;
    if (const auto* map = std::get_if<EnvironmentLight>(&light))
        return sample_environment_map_pdf(scene.lights.environments[map->map], direction);
    return std::max(0.0f, dot(reference.normal, direction)) * k_inv_pi;  // The sky.
}

}  // namespace

std::optional<LightSample> sample_light(const Scene& scene, LightSampling sampling,
                                        const LightReference& reference, float u_pick, Vec2 u) {
    const auto pick = pick_light(scene.lights, sampling, reference, u_pick);
    if (!pick) return std::nullopt;
    const Request request{scene, sampling, reference, pick->light, pick->probability, u};
    return std::visit([&](const auto& kind) { return sample(request, kind); },
                      scene.lights.lights[request.light]);
}

float sample_light_pdf(const Scene& scene, LightSampling sampling, const LightReference& reference,
                       const SceneHit& hit) {
    if (hit.light == k_no_light) return 0;
    const Connection to_light(reference, hit.point.position);
    const Vec3 normal = hit.point.geometric_normal;
    if (!to_light.valid() || !emits_towards(scene.materials[hit.point.material], normal, -to_light.direction))
        return 0;

    const Light& light = scene.lights.lights[hit.light];
    const float probability = pick_probability(scene.lights, sampling, reference, hit.light);
    if (const auto* sphere = std::get_if<SphereLight>(&light))
        return probability * sphere_pdf(sampling, reference, to_light, scene.spheres[sphere->sphere], normal);
    const auto& triangle = std::get<TriangleLight>(light);
    return probability *
           triangle_pdf(seen_from_near(sampling, reference, triangle), to_light, triangle, normal);
}

float sample_environment_pdf(const Scene& scene, LightSampling sampling, const LightReference& reference,
                             Vec3 direction) {
    float sum = 0;
    for (const std::uint32_t light : scene.lights.infinite)
        sum += pick_probability(scene.lights, sampling, reference, light) *
               direction_pdf(scene, scene.lights.lights[light], reference, direction);
    return sum;
}

}  // namespace pathscope
