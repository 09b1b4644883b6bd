#include <limits>

#include "pathscope/math/random.hpp"
#include "pathscope/scene/scene.hpp"
#include "small_scenes.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr Rgb k_white{1, 1, 1};

/// A wall at z = 0 whose left half (u < 1/2) is cut out.
SceneParts wall_with_hole() {
    Image8 halves{2, 1, 1, {0, 255}};
    SceneParts parts = empty_parts();
    parts.textures.emplace_back(TextureUsage::grey, halves);
    Material lattice = grey();
    lattice.map_d.index = 0;
    add_rectangle(parts, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, add_material(parts, lattice));
    return parts;
}

/// A floor whose material has an MTL's Ke.
SceneParts glowing_floor() {
    SceneParts parts = empty_parts();
    Material glowing = grey();
    glowing.ke = {4, 2, 1};
    add_rectangle(parts, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, add_material(parts, glowing));
    return parts;
}

}  // namespace

TEST_CASE("a ray meets whichever is nearer, triangle or sphere") {
    SceneParts parts = empty_parts();
    add_rectangle(parts, {-9, -9, 0}, {18, 0, 0}, {0, 18, 0});
    const Scene scene = small_scene(
        std::move(parts), {SphereLightSpec{{0, 0, 3}, 1, k_white}, SphereLightSpec{{0, 0, -3}, 1, k_white}});
    const auto sphere = intersect(scene, {{0, 0, 9}, {0, 0, -1}});
    REQUIRE(sphere);
    CHECK(sphere->distance == doctest::Approx(5));
    CHECK(sphere->point.triangle == k_no_triangle);
    CHECK(length(sphere->point.geometric_normal - Vec3{0, 0, 1}) < 1e-6f);
    REQUIRE(sphere->light != k_no_light);
    CHECK(light_kind(scene.lights.lights[sphere->light]) == LightKind::sphere);

    const auto between = intersect(scene, {{0, 0, 1.5f}, {0, 0, -1}});
    REQUIRE(between);
    CHECK(between->distance == doctest::Approx(1.5));
    CHECK(between->point.triangle < 2);
    CHECK(between->light == k_no_light);

    const auto inside = intersect(scene, {{0, 0, 3}, {0, 0, -1}});
    REQUIRE(inside);
    CHECK(inside->distance == doctest::Approx(1));
    CHECK_FALSE(intersect(scene, {{0, 0, 9}, {0, 0, 1}}));
}

TEST_CASE("occlusion knows triangles, spheres, and where the ray ends") {
    SceneParts parts = empty_parts();
    add_rectangle(parts, {-9, -9, 0}, {18, 0, 0}, {0, 18, 0});
    const Scene scene = small_scene(std::move(parts), {SphereLightSpec{{0, 0, 3}, 1, k_white}});
    CHECK(occluded(scene, {{5, 5, 1}, {0, 0, -1}}));
    CHECK_FALSE(occluded(scene, {{5, 5, 1}, {0, 0, 1}}));
    CHECK_FALSE(occluded(scene, {{5, 5, 1}, {0, 0, -1}, 0, 0.99f}));
    CHECK(occluded(scene, {{0, 0, 1}, {0, 0, 1}}));
    CHECK_FALSE(occluded(scene, {{0, 0, 1}, {0, 0, 1}, 0, 0.99f}));
}

TEST_CASE("cut-outs are holes for rays of both sorts") {
    const Scene scene = small_scene(wall_with_hole(), {SkySpec{k_white}});
    CHECK(has_cutouts(scene));
    for (const float x : {-0.9f, -0.6f}) {
        CHECK_FALSE(intersect(scene, {{x, 0.3f, 1}, {0, 0, -1}}));
        CHECK_FALSE(occluded(scene, {{x, 0.3f, 1}, {0, 0, -1}}));
    }
    for (const float x : {0.6f, 0.3f}) {
        CHECK(intersect(scene, {{x, 0.3f, 1}, {0, 0, -1}}));
        CHECK(occluded(scene, {{x, 0.3f, 1}, {0, 0, -1}}));
    }
    CHECK(is_solid(scene, 0, 1, 0));
    CHECK_FALSE(is_solid(scene, 0, 0.1f, 0.1f));
}

TEST_CASE("a probe sees the traversal and changes nothing") {
    const Scene scene = small_scene(wall_with_hole(), {SkySpec{k_white}});
    TraversalCounts counts;
    const Ray ray{{0.5f, 0.3f, 1}, {0, 0, -1}};
    const auto watched = intersect(scene, ray, counts);
    REQUIRE(watched);
    CHECK(watched->distance == intersect(scene, ray)->distance);
    CHECK(counts.triangles >= 1);
}

TEST_CASE("quads join a mesh whatever it holds, and face along edge_u x edge_v") {
    const QuadLightSpec quad{{0, 5, 0}, {0, 0, 2}, {3, 0, 0}, k_white};  // u x v points up.
    for (const bool normals : {false, true}) {
        for (const bool uvs : {false, true}) {
            SceneParts parts = empty_parts();
            add_rectangle(parts, {0, 0, 0}, {0, 0, 1}, {1, 0, 0});
            if (normals) parts.mesh.normals.assign(4, {0, -1, 0});
            if (!uvs) parts.mesh.uvs.clear();
            parts.mesh.materials.clear();
            const Scene scene = small_scene(std::move(parts), {quad});
            REQUIRE(validate(scene.mesh));
            CHECK(scene.mesh.triangle_count() == 4);
            const auto hit = intersect(scene, {{2, 9, 1}, {0, -1, 0}});
            REQUIRE(hit);
            CHECK(hit->distance == doctest::Approx(4));
            CHECK(length(hit->point.geometric_normal - Vec3{0, 1, 0}) < 1e-6f);
            CHECK(emitted_radiance(scene, *hit, {0, 1, 0}) == k_white);
            CHECK(is_zero(emitted_radiance(scene, *hit, {0, -1, 0})));
            const auto floor = intersect(scene, {{0.5f, 2, 0.5f}, {0, -1, 0}});
            REQUIRE(floor);
            CHECK(floor->point.material == 0);
        }
    }
}

TEST_CASE("Ke lights the scene if the file lists it, or no light at all") {
    const auto lights = [](std::vector<LightSpec> specs) {
        const Scene scene = small_scene(glowing_floor(), std::move(specs));
        const auto hit = intersect(scene, {{0.2f, 1, 0.1f}, {0, -1, 0}});
        const bool glows = !is_zero(emitted_radiance(scene, *hit, {0, 1, 0}));
        CHECK(glows == (hit->light != k_no_light));
        return glows ? int(scene.lights.lights.size()) : -int(scene.lights.lights.size());
    };
    CHECK(lights({}) == 1);
    CHECK(lights({EmissiveMtlSpec{}}) == 1);
    CHECK(lights({SkySpec{k_white}, EmissiveMtlSpec{}}) == 2);
    CHECK(lights({SkySpec{k_white}}) == -1);
}

TEST_CASE("the range of brightness covers the brightest emitter and what it lights") {
    const auto range = [](std::vector<LightSpec> specs) {
        const Scene scene = small_scene(glowing_floor(), std::move(specs));
        return std::pair(scene.typical_radiance, scene.brightest_radiance);
    };
    CHECK(range({}) == std::pair(4.0f, 4.0f));
    CHECK(range({SkySpec{{1, 2, 3}}}) == std::pair(3.0f, 3.0f));

    const auto [sunny, disc] = range({SunSpec{{0, 1, 0}, {k_pi, 0, 0}, 0.53f}, SkySpec{{0.5f, 0, 0}}});
    CHECK(sunny == doctest::Approx(1));
    CHECK(disc == doctest::Approx(0.5 + 1 / (std::pow(std::sin(0.265 * 3.14159265 / 180), 2))));

    const auto [near, bulb] = range({PointLightSpec{{0, 1, 0}, {6, 6, 6}}});
    CHECK(near == doctest::Approx(3));  // The floor's bounding sphere has the radius sqrt(2).
    CHECK(bulb == doctest::Approx(3));
}

TEST_CASE("bounds hold mesh, quads and spheres; an empty scene has a disc for the sky to fall on") {
    const Scene scene = small_scene(glowing_floor(), {SphereLightSpec{{0, 10, 0}, 2, k_white}});
    CHECK(scene.bounds.high == Vec3{2, 12, 2});
    CHECK(scene.bounds.low == Vec3{-2, 0, -2});
    CHECK(scene_radius(small_scene({SkySpec{k_white}})) == 1);
}

TEST_CASE("the brightest and the faintest lights can be picked from") {
    constexpr float k_faintest = std::numeric_limits<float>::denorm_min();
    for (const float value : {1e30f, k_faintest}) {
        const Scene scene = small_scene({SkySpec{{0, 0, value}}, PointLightSpec{{0, 1, 0}, {0, 0, value}}});
        REQUIRE(scene.lights.lights.size() == 2);
        for (std::uint32_t light = 0; light < 2; ++light)
            CHECK(pick_probability(scene.lights, LightSampling::power, {}, light) > 0);
    }
}

TEST_CASE("what cannot be computed with is refused in a sentence") {
    SceneFile file;
    file.lights = {SphereLightSpec{{0, 1e20f, 0}, 1, k_white}};
    const auto huge = make_scene(file, empty_parts(), {.threads = 1});
    REQUIRE_FALSE(huge);
    CHECK(huge.error().message.find("scale it down") != std::string::npos);

    // Each of these numbers is a float; what follows from them is none: a disc too narrow, a sky from all sides.
    constexpr float k_most = std::numeric_limits<float>::max();
    const std::vector<std::vector<LightSpec>> too_bright{
        {SunSpec{{0, 1, 0}, {k_most, 0, 0}, 0.53f}},
        {SunSpec{{0, 1, 0}, k_white, 1e-18f}},
        {SkySpec{{0, k_most, 0}}},
        {SkySpec{{0, k_most, 0}}, SkySpec{{0, k_most, 0}}},
    };
    for (const std::vector<LightSpec>& lights : too_bright) {
        file.lights = lights;
        const auto glaring = make_scene(file, empty_parts(), {.threads = 1});
        REQUIRE_FALSE(glaring);
        CHECK(glaring.error().message.find("make them darker") != std::string::npos);
    }

    file.lights = {EnvmapSpec{"night.hdr", 1, 0}};
    SceneParts parts = empty_parts();
    parts.envmap = Image(4, 2);
    const auto black = make_scene(file, std::move(parts), {.threads = 1});
    REQUIRE_FALSE(black);
    CHECK(black.error().message.starts_with("night.hdr: "));
}
