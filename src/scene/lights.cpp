#include "pathscope/scene/lights.hpp"

#include <algorithm>
#include <limits>

#include "pathscope/core/check.hpp"
#include "pathscope/geometry/hit.hpp"

namespace pathscope {
namespace {

constexpr double k_double_pi = 3.14159265358979323846;

/// Sine of an angle in degrees; in double, so that after rounding every libm gives the same float.
float sine_of(double degrees) { return float(std::sin(degrees * (k_double_pi / 180))); }

/// Each radiance sends π per area; from the whole sphere of directions, 4π through each point of the disc.
double power_of(const LightTable&, const TriangleLight& light, double) {
    return luminance(light.mean_radiance) * k_double_pi * light.area * (light.two_sided ? 2 : 1);
}
double power_of(const LightTable&, const SphereLight& light, double) {
    return luminance(light.radiance) * k_double_pi * light_area(light);
}
double power_of(const LightTable&, const PointLight& light, double) {
    return luminance(light.intensity) * 4 * k_double_pi;
}
double power_of(const LightTable&, const SunLight& light, double disc_area) {
    return luminance(light.irradiance) * disc_area;
}
double power_of(const LightTable&, const SkyLight& light, double disc_area) {
    return luminance(light.radiance) * 4 * k_double_pi * disc_area;
}
double power_of(const LightTable& table, const EnvironmentLight& light, double disc_area) {
    return luminance(table.environments[light.map].mean_radiance) * 4 * k_double_pi * disc_area;
}

std::vector<double> weights_by_power(const LightTable& table, float scene_radius) {
    std::vector<double> weights;
    for (const Light& light : table.lights) weights.push_back(light_power(table, light, scene_radius));
    return weights;
}

/// In units of one share, which is 1 for each light without area and 1 for all surface together.
std::vector<double> weights_by_area(const LightTable& table) {
    double total = 0;
    for (const Light& light : table.lights) total += light_area(light);
    std::vector<double> weights;
    for (const Light& light : table.lights) {
        const double area = light_area(light);
        weights.push_back(area > 0 ? area / total : 1);
    }
    return weights;
}

/// Relative to the largest, so that they fit into floats; none becomes zero.
Distribution1d make_pick(const std::vector<double>& weights) {
    const double largest = *std::max_element(weights.begin(), weights.end());
    std::vector<float> relative;
    for (const double weight : weights)
        relative.push_back(std::max(float(weight / largest), std::numeric_limits<float>::min()));
    auto pick = Distribution1d::make(relative);
    CHECK(pick, weights.size(), largest);
    return *std::move(pick);
}

/// Whether surface_point() gives one geometric normal all over the triangle: it does unless the normals of the corners
/// can be mixed to one that lies below the plane. Those that come near to it, by rounding, are not trusted.
bool has_one_normal(const Mesh& mesh, std::uint32_t triangle, Vec3 normal) {
    if (mesh.normals.empty()) return true;
    const auto clearly_above = [&](std::uint32_t vertex) {
        const Vec3 n = mesh.normals[vertex];
        return is_zero(n) || dot(n, normal) > 0.001f * length(n);
    };
    const TriangleIndices& i = mesh.triangles[triangle];
    return clearly_above(i.a) && clearly_above(i.b) && clearly_above(i.c);
}

bool seen_by_escaping_rays(const Light& light) {
    if (const auto* sun = std::get_if<SunLight>(&light)) return !sun->is_delta();
    return std::holds_alternative<SkyLight>(light) || std::holds_alternative<EnvironmentLight>(light);
}

}  // namespace

TriangleLight make_triangle_light(const Mesh& mesh, std::uint32_t triangle, const Material& material,
                                  Rgb mean_radiance) {
    TriangleLight light;
    light.triangle = triangle;
    light.corners = corners(mesh, triangle);
    light.area = area(light.corners);
    light.mean_radiance = mean_radiance;
    light.two_sided = material.two_sided_emission;
    light.longest_side = longest_side(light.corners);
    light.normal = surface_point(mesh, {0, 1 / 3.0f, 1 / 3.0f, triangle}).geometric_normal;
    light.even = !material.map_ke && !material.map_d && has_one_normal(mesh, triangle, light.normal);
    return light;
}

SunLight make_sun_light(Vec3 to_sun, Rgb irradiance, float angle_deg) {
    CHECK(angle_deg >= 0 && angle_deg <= 180, angle_deg);
    SunLight sun;
    sun.to_sun = normalize(to_sun);
    sun.irradiance = irradiance;
    const float sine = sine_of(angle_deg * 0.5), sine_of_half = sine_of(angle_deg * 0.25);
    sun.one_minus_cos = 2 * sine_of_half * sine_of_half;
    if (!sun.is_delta()) sun.radiance = irradiance / (k_pi * sine * sine);
    return sun;
}

bool sun_covers(const SunLight& sun, Vec3 direction) {
    // |a - b|² = 2 (1 - cos): unlike 1 - dot(a, b), the difference of near directions has all its digits.
    return length_squared(direction - sun.to_sun) < 2 * sun.one_minus_cos;
}

double light_power(const LightTable& table, const Light& light, float scene_radius) {
    CHECK(scene_radius > 0, scene_radius);
    const double disc_area = k_double_pi * scene_radius * scene_radius;
    return std::visit([&](const auto& kind) { return power_of(table, kind, disc_area); }, light);
}

double light_area(const Light& light) {
    if (const auto* triangle = std::get_if<TriangleLight>(&light)) return triangle->area;
    const auto* sphere = std::get_if<SphereLight>(&light);
    return sphere ? 4 * k_double_pi * sphere->radius * sphere->radius : 0;
}

void finish_light_table(LightTable& table, float scene_radius) {
    table.infinite.clear();
    for (std::uint32_t i = 0; i < table.lights.size(); ++i)
        if (seen_by_escaping_rays(table.lights[i])) table.infinite.push_back(i);
    if (table.empty()) return;
    table.pick[std::size_t(LightSampling::area)] = make_pick(weights_by_area(table));
    table.pick[std::size_t(LightSampling::power)] = make_pick(weights_by_power(table, scene_radius));
}

}  // namespace pathscope
