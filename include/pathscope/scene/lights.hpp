#pragma once
/// The lights of a scene in the form that sampling needs, and the table that picks one of them.
///
///   Lr ≈ f Le cos θ / (P(light) pdf(direction | light))
///
/// is one sample of the light that a point reflects. This header holds the lights and P(light); the densities
/// of directions are in light_sampling.hpp. There are three ways to pick, for lessons to compare; all converge
/// to the same image:
///   area   the textbook: all emitting surface together is one light, sampled uniformly, pdf_area = 1 / A.
///          Lights without area (point, sun, sky, environment) get equal shares beside it: where there are k
///          of them each is picked with probability 1 / (k + 1), and the surface with the rest.
///   power  each light in proportion to the power that it sends out; light from infinity sends what falls on
///          the disc that just covers the scene. Of two lights each is picked as often as the other: a vertex takes two
///          samples then, and so one of each (integrator/direct_light.hpp).
///   tree   each light by what it may send to the point at hand (light_tree.hpp). The lights at infinity stand beside
///          the tree: half of the picks are shared equally, among k of them and the tree, and half in proportion to the
///          irradiance that each would give without shadows. Equal shares alone waste samples on a faint sky,
///          irradiance alone starves the lamps of a room from which the sun is shut out. Scenes with fewer finite
///          lights than k_least_tree_lights have no tree, and pick by power.
/// Units: radiance W/(m² sr), intensity W/sr, irradiance W/m², each as linear Rgb; powers are luminances.
/// See: for area, Y. Huang, "A Distributed Path Tracer"; for power, Shirley, Wang & Zimmerman 1996, "Monte
/// Carlo Techniques for Direct Lighting Calculations".
/// Thread safety: values, read only once finished.
/// Test: tests/scene/test_lights.cpp     Lesson: lessons/04-light-sampling

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "pathscope/core/check.hpp"
#include "pathscope/core/enum_names.hpp"
#include "pathscope/geometry/mesh.hpp"
#include "pathscope/math/vec.hpp"
#include "pathscope/sampling/distribution.hpp"
#include "pathscope/scene/environment.hpp"
#include "pathscope/scene/light_tree.hpp"
#include "pathscope/scene/material.hpp"

namespace pathscope {

enum class LightSampling : std::uint8_t { area, power, tree };
inline constexpr std::array k_light_sampling_names{
    EnumName{LightSampling::area, "area"},
    EnumName{LightSampling::power, "power"},
    EnumName{LightSampling::tree, "tree"},
};
constexpr const auto& enum_table(LightSampling) { return k_light_sampling_names; }

/// A triangle of the mesh whose material emits; or two of them that make a quad, as most lamps are. As one light a quad has one
/// sample where two triangles would need two, and samples of it are spread over all of it.
struct TriangleLight {
    std::uint32_t triangle = 0;
    float area = 0;         ///< Of both.
    Rgb mean_radiance;      ///< For its power; emission itself is looked up at each point (map_ke, cut-outs).
    bool two_sided = true;  ///< Otherwise it emits on the side of its normal only.

    /// True if normal and emission are the same at each of its points. Then all that sampling needs to know lies here, in
    /// one place of memory, and mean_radiance is the radiance; else the mesh and the maps are asked at each point.
    bool even = false;
    std::uint32_t second_triangle = k_no_second_triangle;
    float first_share = 1;  ///< Of the first triangle in the area.
    std::array<TriangleCorners, 2> corners{};
    Vec3 normal{};  ///< As surface_point() gives it.
    Vec3 centre{};
    float longest_side = 0;  ///< Of the box around all corners.

    static constexpr std::uint32_t k_no_second_triangle = 0xffffffffu;
    [[nodiscard]] bool is_quad() const { return second_triangle != k_no_second_triangle; }
};

/// A sphere that emits the same radiance everywhere, outwards, and is black inside.
struct SphereLight {
    std::uint32_t sphere = 0;  ///< In Scene::spheres.
    float radius = 1;
    Rgb radiance;
};

struct PointLight {
    Vec3 position;
    Rgb intensity;  ///< Irradiance at distance r, on a plane that faces the light, is intensity / r².
};

/// A disc at infinity: all directions within half of its angular diameter of to_sun. Of angle 0 it is a
/// single direction, which only light sampling finds.
struct SunLight {
    Vec3 to_sun{0, 1, 0};     ///< Length one.
    Rgb irradiance;           ///< On a plane that faces the sun.
    Rgb radiance;             ///< irradiance / (π sin²(half angle)); zero for angle 0.
    float one_minus_cos = 0;  ///< 1 - cos(half angle): see sample_cone() for why not the cosine.

    [[nodiscard]] bool is_delta() const { return one_minus_cos == 0; }
};

/// Requires: the triangle is not degenerate; its material emits.
[[nodiscard]] TriangleLight make_triangle_light(const Mesh& mesh, std::uint32_t triangle,
                                                const Material& material, Rgb mean_radiance);

/// The two as one light; nothing unless both are even, have an edge in common, and do not differ but in their corners.
/// Requires: neither is a quad.
[[nodiscard]] std::optional<TriangleLight> make_quad_light(const TriangleLight& first,
                                                           const TriangleLight& second);

/// Requires: to_sun not zero; angle_deg, the angular diameter, in [0, 180].
[[nodiscard]] SunLight make_sun_light(Vec3 to_sun, Rgb irradiance, float angle_deg);

/// Whether the disc covers a direction of length one. Never, for a delta.
[[nodiscard]] bool sun_covers(const SunLight& sun, Vec3 direction);

/// The same radiance from all directions.
struct SkyLight {
    Rgb radiance;
};

struct EnvironmentLight {
    std::uint32_t map = 0;  ///< In LightTable::environments.
};

using Light = std::variant<TriangleLight, SphereLight, PointLight, SunLight, SkyLight, EnvironmentLight>;

/// Names of the kinds, in the order of Light: for path tables and statistics.
enum class LightKind : std::uint8_t { triangle, sphere, point, sun, sky, environment };
inline constexpr std::array k_light_kind_names{
    EnumName{LightKind::triangle, "triangle"}, EnumName{LightKind::sphere, "sphere"},
    EnumName{LightKind::point, "point"},       EnumName{LightKind::sun, "sun"},
    EnumName{LightKind::sky, "sky"},           EnumName{LightKind::environment, "environment"},
};
constexpr const auto& enum_table(LightKind) { return k_light_kind_names; }

[[nodiscard]] inline LightKind light_kind(const Light& light) { return LightKind(light.index()); }

inline constexpr std::uint32_t k_no_light = 0xffffffffu;

struct LightTable {
    std::vector<Light> lights;
    std::vector<EnvironmentMap> environments;
    std::vector<std::uint32_t> of_triangle;  ///< Of each mesh triangle, or k_no_light; empty if none emits.
    std::vector<std::uint32_t> of_sphere;    ///< Of each of Scene::spheres.
    std::vector<std::uint32_t> infinite;     ///< Those that a ray may see which leaves the scene: no deltas.
    std::array<Distribution1d, 2> pick;      ///< Over `lights`, by area or power; nothing without lights.
    LightTree tree;                          ///< Over the finite lights; empty where it would not pay.
    std::vector<std::uint32_t> in_tree;      ///< The light of each of its bounds.
    std::vector<std::uint32_t> of_tree;      ///< Of each light, its place in in_tree, or k_no_light.
    std::vector<std::uint32_t> beside_tree;  ///< All lights at infinity, deltas too.

    [[nodiscard]] bool empty() const { return lights.empty(); }
};

/// Luminance of the power that a light sends out. Requires: the radius of the scene's bounding sphere, > 0.
[[nodiscard]] double light_power(const LightTable& table, const Light& light, float scene_radius);

/// The surface it emits from; 0 for lights that have none.
[[nodiscard]] double light_area(const Light& light);

/// Fewer finite lights are better picked by power: the walk costs more than it gains. With four, the lamps over the plates of
/// scenes/mis_plates, it pays: variance times processor time is 0.85 of that by power, relative variance times
/// processor time 0.89.
inline constexpr std::uint32_t k_least_tree_lights = 4;

/// Fills `infinite`, `pick` and the tree. bounds: of each light, or nothing for one at infinity.
/// Requires: the other members are filled, every light emits something.
void finish_light_table(LightTable& table, float scene_radius,
                        std::span<const std::optional<LightBounds>> bounds);

/// P(light) where the point does not matter. Requires: by area or power; light < lights.size().
[[nodiscard]] inline float pick_probability(const LightTable& table, LightSampling sampling,
                                            std::uint32_t light) {
    CHECK(sampling != LightSampling::tree);
    return table.pick[std::size_t(sampling)].pmf(int(light));
}

struct LightPick {
    std::uint32_t light = 0;
    float probability = 0;  ///< > 0
};

/// Nothing if there is no light, or none that could reach the point. Requires: u in [0, 1).
[[nodiscard]] std::optional<LightPick> pick_light(const LightTable& table, LightSampling sampling,
                                                  const LightReference& reference, float u);

/// P(light) at the point. Requires: light < lights.size().
[[nodiscard]] float pick_probability(const LightTable& table, LightSampling sampling,
                                     const LightReference& reference, std::uint32_t light);

}  // namespace pathscope
