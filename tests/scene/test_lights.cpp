#include <numbers>

#include "pathscope/scene/lights.hpp"
#include "small_scenes.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// The sum of P(light) over the lights of one kind.
double share(const Scene& scene, LightSampling sampling, LightKind kind) {
    double sum = 0;
    for (std::uint32_t i = 0; i < scene.lights.lights.size(); ++i)
        if (light_kind(scene.lights.lights[i]) == kind) sum += pick_probability(scene.lights, sampling, i);
    return sum;
}

}  // namespace

TEST_CASE("names of light sampling and of kinds of lights lead there and back") {
    for (const auto& entry : k_light_sampling_names)
        CHECK(from_name<LightSampling>(entry.name) == entry.value);
    for (const auto& entry : k_light_kind_names) CHECK(from_name<LightKind>(entry.name) == entry.value);
    CHECK(k_light_kind_names.size() == std::variant_size_v<Light>);
    CHECK(light_kind(Light{SkyLight{}}) == LightKind::sky);
    CHECK(light_kind(Light{EnvironmentLight{}}) == LightKind::environment);
}

TEST_CASE("powers are those of the textbook") {
    const double pi = std::numbers::pi;
    const LightTable table;
    const auto power = [&](const Light& light) { return light_power(table, light, 3); };
    const Rgb white{1, 1, 1};
    CHECK(power(TriangleLight{0, 5, white, false}) == doctest::Approx(5 * pi));
    CHECK(power(TriangleLight{0, 5, white, true}) == doctest::Approx(10 * pi));
    CHECK(power(SphereLight{0, 2, white}) == doctest::Approx(16 * pi * pi));
    CHECK(power(PointLight{{}, white}) == doctest::Approx(4 * pi));
    CHECK(power(make_sun_light({0, 1, 0}, white, 1)) == doctest::Approx(9 * pi));
    CHECK(power(SkyLight{white}) == doctest::Approx(36 * pi * pi));
}

TEST_CASE("a sun's disc gives its irradiance, down to the angle of the real sun and below") {
    for (const float angle : {0.001f, 0.53f, 2.0f, 90.0f, 180.0f}) {
        const SunLight sun = make_sun_light({0, 3, 4}, {7, 5, 3}, angle);
        CHECK(length(sun.to_sun) == doctest::Approx(1));
        // E = L π sin² h, from the solid angle 2π (1 - cos h): sin² = (1 - cos)(1 + cos).
        const double k = sun.one_minus_cos;
        CHECK(double(sun.radiance.x) * std::numbers::pi * k * (2 - k) == doctest::Approx(7));
        const double half = angle * std::numbers::pi / 360;
        CHECK(k == doctest::Approx(2 * std::sin(half / 2) * std::sin(half / 2)));
    }
    CHECK(make_sun_light({0, 1, 0}, {1, 1, 1}, 0).is_delta());
}

TEST_CASE("the sun's disc ends where it should") {
    const SunLight sun = make_sun_light({0, 0, 1}, {1, 1, 1}, 0.5f);
    const auto covers = [&](double degrees) {
        const double angle = degrees * std::numbers::pi / 180;
        return sun_covers(sun, {float(std::sin(angle)), 0, float(std::cos(angle))});
    };
    CHECK(covers(0));
    CHECK(covers(0.2499));
    CHECK_FALSE(covers(0.2501));
    CHECK_FALSE(covers(180));
    CHECK_FALSE(sun_covers(make_sun_light({0, 0, 1}, {1, 1, 1}, 0), {0, 0, 1}));
}

TEST_CASE("area: surface is one light, uniform over all of it; each other light has the same share") {
    SceneParts parts = empty_parts();
    add_rectangle(parts, {0, 0, 0}, {1, 0, 0}, {0, 0, 1});
    const Scene scene =
        small_scene(std::move(parts), {QuadLightSpec{{0, 1, 0}, {1, 0, 0}, {0, 0, 3}, {1, 1, 1}},
                                       QuadLightSpec{{5, 1, 0}, {1, 0, 0}, {0, 0, 1}, {9, 9, 9}},
                                       SphereLightSpec{{0, 5, 0}, 1, {1, 1, 1}}, SkySpec{{1, 1, 1}},
                                       PointLightSpec{{0, 9, 0}, {1, 1, 1}}});
    const double total = 3 + 1 + 4 * std::numbers::pi;
    CHECK(share(scene, LightSampling::area, LightKind::triangle) ==
          doctest::Approx(4 / total / 3).epsilon(1e-5));
    CHECK(share(scene, LightSampling::area, LightKind::sphere) ==
          doctest::Approx(4 * std::numbers::pi / total / 3).epsilon(1e-5));
    CHECK(share(scene, LightSampling::area, LightKind::sky) == doctest::Approx(1 / 3.0).epsilon(1e-5));
    CHECK(share(scene, LightSampling::area, LightKind::point) == doctest::Approx(1 / 3.0).epsilon(1e-5));
    for (std::uint32_t i = 0; i < scene.lights.lights.size(); ++i) {
        const auto* triangle = std::get_if<TriangleLight>(&scene.lights.lights[i]);
        if (!triangle) continue;
        CHECK(pick_probability(scene.lights, LightSampling::area, i) / triangle->area ==
              doctest::Approx(1 / total / 3).epsilon(1e-4));
    }
}

TEST_CASE("power: nine times the radiance or nine times the area is picked nine times as often") {
    const Scene scene = small_scene({QuadLightSpec{{0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {1, 1, 1}},
                                     QuadLightSpec{{5, 1, 0}, {1, 0, 0}, {0, 0, 1}, {9, 9, 9}},
                                     QuadLightSpec{{9, 1, 0}, {3, 0, 0}, {0, 0, 3}, {1, 1, 1}}});
    REQUIRE(scene.lights.lights.size() == 3);
    const auto p = [&](std::uint32_t light) {
        return pick_probability(scene.lights, LightSampling::power, light);
    };
    CHECK(p(0) == doctest::Approx(1 / 19.0).epsilon(1e-5));
    CHECK(p(1) == doctest::Approx(9 / 19.0).epsilon(1e-5));
    CHECK(p(2) == doctest::Approx(9 / 19.0).epsilon(1e-5));
}

TEST_CASE("power: of two lights each is picked as often as the other, so that two samples are one of each") {
    const Scene scene = small_scene({SkySpec{{1, 1, 1}}, SunSpec{{0, 1, 0}, {9, 9, 9}, 1}});
    for (const LightSampling sampling : {LightSampling::power, LightSampling::tree})
        for (const float u : {0.0f, 0.3f, 0.49f}) {
            const auto first = pick_light(scene.lights, sampling, {}, u);
            const auto second = pick_light(scene.lights, sampling, {}, u + 0.5f);
            REQUIRE((first && second));
            CHECK(first->light != second->light);
            CHECK(first->probability == 0.5f);
            CHECK(second->probability == 0.5f);
        }
}

TEST_CASE("two triangles in a row that make an even quad are one light, and no others are") {
    SceneParts quads = empty_parts();
    Material lamp = grey();
    lamp.ke = {1, 1, 1};
    const std::uint32_t material = add_material(quads, lamp);
    add_rectangle(quads, {0, 0, 0}, {1, 0, 0}, {0, 0, 1}, material);
    add_rectangle(quads, {5, 0, 0}, {1, 0, 0}, {0, 0, 2}, material);
    const auto lights_of = [&](const SceneParts& parts) {
        return small_scene(parts, {EmissiveMtlSpec{}}).lights;
    };
    const LightTable two = lights_of(quads);
    REQUIRE(two.lights.size() == 2);
    CHECK(two.of_triangle == std::vector<std::uint32_t>{0, 0, 1, 1});
    const TriangleLight& second = std::get<TriangleLight>(two.lights[1]);
    CHECK(second.is_quad());
    CHECK(second.area == doctest::Approx(2));
    CHECK(second.first_share == doctest::Approx(0.5));
    CHECK(second.longest_side == doctest::Approx(2));
    CHECK(second.centre == Vec3{5.5f, 0, 1});

    SceneParts folded = quads, mapped = quads, apart = quads, mixed = quads;
    folded.mesh.positions[2].y = 0.5f;
    CHECK(lights_of(folded).lights.size() == 3);
    std::swap(apart.mesh.triangles[1], apart.mesh.triangles[2]);
    CHECK(lights_of(apart).lights.size() == 4);
    mixed.mesh.materials[1] = add_material(mixed, lamp);
    mixed.materials.back().ke = {1, 1, 2};
    CHECK(lights_of(mixed).lights.size() == 3);
    mapped.textures.push_back(Texture(TextureUsage::colour, Image8{1, 1, 3, {255, 255, 255}}));
    mapped.materials[material].map_ke.index = 0;
    CHECK(lights_of(mapped).lights.size() == 4);
}

TEST_CASE("a light fainter by 40 orders of magnitude is still picked at times") {
    const Scene scene = small_scene({PointLightSpec{{0, 0, 0}, {1e-20f, 1e-20f, 1e-20f}},
                                     PointLightSpec{{0, 0, 0}, {1e20f, 1e20f, 1e20f}}});
    CHECK(pick_probability(scene.lights, LightSampling::power, 0) > 0);
}
