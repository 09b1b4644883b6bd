#include "pathscope/scene/lights.hpp"

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

/// Sine of an angle in degrees; in double, so that after rounding every libm gives the same float.
float sine_of(double degrees) { return float(std::sin(degrees * (3.14159265358979323846 / 180))); }

/// A constant radiance from the whole sphere of directions sends 4π of it through each point of the disc.
float power_from_all_directions(Rgb radiance, float disc_area) {
    return luminance(radiance) * 4 * k_pi * disc_area;
}

float power_of(const LightTable&, const TriangleLight& light, float) {
    return luminance(light.mean_radiance) * k_pi * light.area * (light.two_sided ? 2 : 1);
}
float power_of(const LightTable&, const SphereLight& light, float) {
    return luminance(light.radiance) * k_pi * light_area(light);
}
float power_of(const LightTable&, const PointLight& light, float) {
    return luminance(light.intensity) * 4 * k_pi;
}
float power_of(const LightTable&, const SunLight& light, float disc_area) {
    return luminance(light.irradiance) * disc_area;
}
float power_of(const LightTable&, const SkyLight& light, float disc_area) {
    return power_from_all_directions(light.radiance, disc_area);
}
float power_of(const LightTable& table, const EnvironmentLight& light, float disc_area) {
    return power_from_all_directions(table.environments[light.map].mean_radiance, disc_area);
}

std::vector<float> weights_by_power(const LightTable& table, float scene_radius) {
    std::vector<float> weights;
    for (const Light& light : table.lights) weights.push_back(light_power(table, light, scene_radius));
    return weights;
}

/// In units of one share, which is 1 for each light without area and 1 for all surface together.
std::vector<float> weights_by_area(const LightTable& table) {
    double total = 0;
    for (const Light& light : table.lights) total += light_area(light);
    std::vector<float> weights;
    for (const Light& light : table.lights) {
        const double area = light_area(light);
        weights.push_back(area > 0 ? float(area / total) : 1.0f);
    }
    return weights;
}

Distribution1d make_pick(const std::vector<float>& weights) {
    auto pick = Distribution1d::make(weights);
    CHECK(pick, weights.size());
    return *std::move(pick);
}

bool seen_by_escaping_rays(const Light& light) {
    if (const auto* sun = std::get_if<SunLight>(&light)) return !sun->is_delta();
    return std::holds_alternative<SkyLight>(light) || std::holds_alternative<EnvironmentLight>(light);
}

}  // namespace

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

float light_power(const LightTable& table, const Light& light, float scene_radius) {
    CHECK(scene_radius > 0, scene_radius);
    const float disc_area = k_pi * scene_radius * scene_radius;
    return std::visit([&](const auto& kind) { return power_of(table, kind, disc_area); }, light);
}

float light_area(const Light& light) {
    if (const auto* triangle = std::get_if<TriangleLight>(&light)) return triangle->area;
    if (const auto* sphere = std::get_if<SphereLight>(&light))
        return 4 * k_pi * sphere->radius * sphere->radius;
    return 0;
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
