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
    return double(luminance(light.mean_radiance)) * k_double_pi * light.area * (light.two_sided ? 2 : 1);
}
double power_of(const LightTable&, const SphereLight& light, double) {
    return double(luminance(light.radiance)) * k_double_pi * light_area(light);
}
double power_of(const LightTable&, const PointLight& light, double) {
    return double(luminance(light.intensity)) * 4 * k_double_pi;
}
double power_of(const LightTable&, const SunLight& light, double disc_area) {
    return double(luminance(light.irradiance)) * disc_area;
}
double power_of(const LightTable&, const SkyLight& light, double disc_area) {
    return double(luminance(light.radiance)) * 4 * k_double_pi * disc_area;
}
double power_of(const LightTable& table, const EnvironmentLight& light, double disc_area) {
    return double(luminance(table.environments[light.map].mean_radiance)) * 4 * k_double_pi * disc_area;
}

/// Of two lights each counts the same (lights.hpp).
std::vector<double> weights_by_power(const LightTable& table, float scene_radius) {
    if (table.lights.size() == 2) return {1, 1};
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
/// Light so faint that its luminance is zero is light all the same: if all is, all are alike.
Distribution1d make_pick(const std::vector<double>& weights) {
    const double largest = *std::max_element(weights.begin(), weights.end());
    std::vector<float> relative;
    for (const double weight : weights)
        relative.push_back(
            std::max(largest > 0 ? float(weight / largest) : 1, std::numeric_limits<float>::min()));
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

// ---- Picking with a tree.

constexpr std::uint32_t k_steps = 1u << 24;  // Uniform numbers are multiples of 1 / k_steps.

/// On a plane through the point, if nothing stands between; of a light at infinity.
double irradiance_of(const LightTable& table, const Light& light, const LightReference& reference) {
    if (const auto* sun = std::get_if<SunLight>(&light))
        return luminance(sun->irradiance) * std::max(0.0f, dot(reference.normal, sun->to_sun));
    if (const auto* sky = std::get_if<SkyLight>(&light)) return k_double_pi * luminance(sky->radiance);
    const auto& environment = std::get<EnvironmentLight>(light);
    return k_double_pi * luminance(table.environments[environment.map].mean_radiance);
}

/// How the steps are shared out between the lights at infinity, in their order, and the tree, which takes what is left.
class TreeShares {
  public:
    TreeShares(const LightTable& table, const LightReference& reference)
        : table_(table), reference_(reference) {
        if (table.beside_tree.empty()) return;
        total_ = table.tree.irradiance(reference);
        for (const std::uint32_t light : table.beside_tree) total_ += irradiance_of_light(light);
        equal_ = 0.5 / double(table.beside_tree.size() + 1);
    }
    [[nodiscard]] std::uint32_t of(std::uint32_t light) const {
        const double by_irradiance = total_ > 0 ? 0.5 * irradiance_of_light(light) / total_ : 0;
        return std::max(1u, std::uint32_t((equal_ + by_irradiance) * k_steps));
    }
    [[nodiscard]] std::uint32_t of_tree() const {
        std::uint32_t rest = k_steps;
        for (const std::uint32_t light : table_.beside_tree) rest -= of(light);
        return rest;
    }

  private:
    [[nodiscard]] double irradiance_of_light(std::uint32_t light) const {
        return irradiance_of(table_, table_.lights[light], reference_);
    }

    const LightTable& table_;
    const LightReference& reference_;
    double total_ = 0, equal_ = 0;
};

std::optional<LightPick> pick_by_tree(const LightTable& table, const LightReference& reference, float u) {
    auto step = std::uint32_t(u * float(k_steps));
    const TreeShares shares(table, reference);
    for (const std::uint32_t light : table.beside_tree) {
        const std::uint32_t steps = shares.of(light);
        if (step < steps) return LightPick{light, float(steps) / k_steps};
        step -= steps;
    }
    const auto pick = table.tree.pick(reference, step, shares.of_tree());
    if (!pick) return std::nullopt;
    return LightPick{table.in_tree[pick->light], float(pick->steps) / k_steps};
}

float tree_probability(const LightTable& table, const LightReference& reference, std::uint32_t light) {
    const TreeShares shares(table, reference);
    const std::uint32_t place = table.of_tree[light];
    return float(place == k_no_light ? shares.of(light)
                                     : table.tree.steps_to(reference, place, shares.of_tree())) /
           k_steps;
}

/// A light's own share of the steps must not be more than the tree has, however many lights are beside it.
bool pays(std::size_t finite, std::size_t beside) {
    return finite >= k_least_tree_lights && finite <= LightTree::k_most_lights / (beside + 1);
}

void make_tree(LightTable& table, std::span<const std::optional<LightBounds>> bounds) {
    std::vector<LightBounds> finite;
    table.of_tree.assign(table.lights.size(), k_no_light);
    for (std::uint32_t light = 0; light < table.lights.size(); ++light) {
        if (!bounds[light]) {
            table.beside_tree.push_back(light);
            continue;
        }
        table.of_tree[light] = std::uint32_t(finite.size());
        table.in_tree.push_back(light);
        finite.push_back(*bounds[light]);
    }
    if (pays(finite.size(), table.beside_tree.size())) table.tree = LightTree::make(finite);
}

/// Where there is no tree, power takes its place.
LightSampling in_effect(const LightTable& table, LightSampling sampling) {
    return sampling == LightSampling::tree && table.tree.empty() ? LightSampling::power : sampling;
}

}  // namespace

TriangleLight make_triangle_light(const Mesh& mesh, std::uint32_t triangle, const Material& material,
                                  Rgb mean_radiance) {
    TriangleLight light;
    light.triangle = triangle;
    const TriangleCorners corner = corners(mesh, triangle);
    light.corners[0] = corner;
    light.area = area(corner);
    light.mean_radiance = mean_radiance;
    light.two_sided = material.two_sided_emission;
    light.longest_side = longest_side(corner);
    light.centre = (corner.a + corner.b + corner.c) * (1 / 3.0f);
    light.normal = surface_point(mesh, {0, 1 / 3.0f, 1 / 3.0f, triangle}).geometric_normal;
    light.even = !material.map_ke && !material.map_d && has_one_normal(mesh, triangle, light.normal);
    return light;
}

std::optional<TriangleLight> make_quad_light(const TriangleLight& first, const TriangleLight& second) {
    const bool alike = first.even && second.even && first.normal == second.normal &&
                       first.mean_radiance == second.mean_radiance && first.two_sided == second.two_sided;
    const TriangleCorners &p = first.corners[0], &q = second.corners[0];
    int common = 0;
    for (const Vec3 corner : {q.a, q.b, q.c}) common += corner == p.a || corner == p.b || corner == p.c;
    if (!alike || common != 2) return std::nullopt;

    TriangleLight quad = first;
    quad.second_triangle = second.triangle;
    quad.corners[1] = q;
    quad.area = first.area + second.area;
    quad.first_share = first.area / quad.area;
    Box box = bounds(p);
    box.add(bounds(q));
    quad.longest_side = max_component(box.extent());
    quad.centre = box.centre();
    return quad;
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

void finish_light_table(LightTable& table, float scene_radius,
                        std::span<const std::optional<LightBounds>> bounds) {
    CHECK(bounds.size() == table.lights.size(), bounds.size(), table.lights.size());
    table.infinite.clear();
    for (std::uint32_t i = 0; i < table.lights.size(); ++i)
        if (seen_by_escaping_rays(table.lights[i])) table.infinite.push_back(i);
    if (table.empty()) return;
    table.pick[std::size_t(LightSampling::area)] = make_pick(weights_by_area(table));
    table.pick[std::size_t(LightSampling::power)] = make_pick(weights_by_power(table, scene_radius));
    make_tree(table, bounds);
}

std::optional<LightPick> pick_light(const LightTable& table, LightSampling sampling,
                                    const LightReference& reference, float u) {
    if (table.empty()) return std::nullopt;
    if (table.lights.size() == 1) return LightPick{0, 1};
    sampling = in_effect(table, sampling);
    if (sampling == LightSampling::tree) return pick_by_tree(table, reference, u);
    const Distribution1d& pick = table.pick[std::size_t(sampling)];
    const int light = pick.find(u);
    return LightPick{std::uint32_t(light), pick.pmf(light)};
}

float pick_probability(const LightTable& table, LightSampling sampling, const LightReference& reference,
                       std::uint32_t light) {
    if (table.lights.size() == 1) return 1;
    sampling = in_effect(table, sampling);
    return sampling == LightSampling::tree ? tree_probability(table, reference, light)
                                           : pick_probability(table, sampling, light);
}

}  // namespace pathscope
