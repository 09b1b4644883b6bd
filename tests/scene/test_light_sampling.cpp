#include <numbers>

#include "pathscope/math/frame.hpp"
#include "pathscope/math/random.hpp"
#include "pathscope/scene/light_sampling.hpp"
#include "small_scenes.hpp"
#include "statistics.hpp"

#include "log_capture.hpp"
#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr LightSampling k_all[] = {LightSampling::area, LightSampling::power, LightSampling::tree};
constexpr double k_pi64 = std::numbers::pi;
constexpr Rgb k_white{1, 1, 1};

/// A point of nothing, facing `normal`: it lights up without being hit.
SurfacePoint receiver(Vec3 position, Vec3 normal) {
    SurfacePoint point;
    point.position = position;
    point.geometric_normal = point.shading_normal = normal;
    return point;
}

/// Irradiance by light sampling, red channel. Shadow rays are cast.
Moments estimate_irradiance(const Scene& scene, LightSampling sampling, const SurfacePoint& at, int samples) {
    const LightReference reference{at.position, at.shading_normal};
    HashRng rng(42);
    Moments moments;
    for (int i = 0; i < samples; ++i) {
        const float u_pick = rng.next_float(), u = rng.next_float(), v = rng.next_float();
        const auto sample = sample_light(scene, sampling, reference, u_pick, {u, v});
        double value = 0;
        if (sample && !occluded(scene, shadow_ray(at, *sample)))
            value = double(sample->radiance.x) * std::max(0.0f, dot(sample->direction, reference.normal)) /
                    sample->pdf_solid_angle;
        moments.add(value);
    }
    return moments;
}

/// Within four standard errors (one failure in 16,000 for a correct program), and a hair for rounding.
void check_irradiance(const Scene& scene, const SurfacePoint& at, double expected, int samples = 20'000) {
    for (const LightSampling sampling : k_all) {
        CAPTURE(name_of(sampling));
        const Moments found = estimate_irradiance(scene, sampling, at, samples);
        CAPTURE(found.mean());
        CAPTURE(expected);
        CHECK(std::abs(found.mean() - expected) <= 4 * found.standard_error() + 1e-5 * expected);
        CHECK(found.standard_error() < 0.05 * expected + 1e-12);
    }
}

/// Fraction of a hemisphere's cosine-weighted light that a rectangle of a x b fills, seen from a point at
/// distance h below one of its corners and facing it (Howell, configuration B-4).
double corner_form_factor(double a, double b, double h) {
    const double x = a / h, y = b / h;
    const double p = std::sqrt(1 + x * x), q = std::sqrt(1 + y * y);
    return (x / p * std::atan(y / p) + y / q * std::atan(x / q)) / (2 * k_pi64);
}

/// Density of a direction as MIS asks for it: of whatever a ray meets there.
double pdf_along(const Scene& scene, LightSampling sampling, const LightReference& reference,
                 Vec3 direction) {
    const auto hit = intersect(scene, {reference.position, direction});
    return hit ? sample_light_pdf(scene, sampling, reference, *hit)
               : sample_environment_pdf(scene, sampling, reference, direction);
}

QuadLightSpec ceiling_light(Rgb radiance = k_white) {
    return {{-1, 2, -1.5f}, {2, 0, 0}, {0, 0, 3}, radiance};  // u x v points down.
}

Image gradient_picture() {
    Image picture(8, 6);
    for (int y = 0; y < 6; ++y)
        for (int x = 0; x < 8; ++x) picture.at(x, y) = {float(x + 1), float(y), 0.5f};
    return picture;
}

Scene scene_with_environment(Image picture, std::vector<LightSpec> lights = {}) {
    SceneParts parts = empty_parts();
    parts.envmap = std::move(picture);
    lights.push_back(EnvmapSpec{"test.hdr", 1, 0});
    return small_scene(std::move(parts), std::move(lights));
}

}  // namespace

// ---- Irradiance, in closed form.

TEST_CASE("an even triangle light is sampled from its own record as from the mesh, bit for bit") {
    SceneParts parts = empty_parts();
    Material lamp = grey();
    lamp.ke = {3, 2, 1};
    add_rectangle(parts, {-0.3f, 0.9f, 0.1f}, {0.7f, 0.1f, 0}, {0, 0.2f, 0.6f}, add_material(parts, lamp));
    // Normals of the vertices that follow a curve; the geometric one is turned to their side.
    parts.mesh.normals = {{-0.2f, -1, 0.4f}, {0.3f, -1, 0}, {0, -1, 0.1f}, {0, 0, 0}};
    Scene scene = small_scene(std::move(parts), {EmissiveMtlSpec{false}});
    Scene general = scene;
    for (Light& light : general.lights.lights) {
        auto& triangle = std::get<TriangleLight>(light);
        REQUIRE(triangle.even);
        triangle.even = false;
    }
    HashRng rng(11);
    int lit = 0;
    for (int i = 0; i < 2000; ++i) {
        const LightReference reference{{rng.next_float() - 0.5f, 1.8f * rng.next_float(), rng.next_float()},
                                       {0, 1, 0}};
        const float u_pick = rng.next_float();
        const Vec2 u{rng.next_float(), rng.next_float()};
        const auto sample = sample_light(scene, LightSampling::power, reference, u_pick, u);
        const auto expected = sample_light(general, LightSampling::power, reference, u_pick, u);
        REQUIRE(sample.has_value() == expected.has_value());
        if (!sample) continue;
        ++lit;
        REQUIRE(sample->direction == expected->direction);
        REQUIRE(sample->distance == expected->distance);
        REQUIRE(sample->target.position == expected->target.position);
        REQUIRE(sample->target.position_error == expected->target.position_error);
        REQUIRE(sample->target.normal == expected->target.normal);
        REQUIRE(sample->radiance == expected->radiance);
        REQUIRE(sample->pdf_solid_angle == expected->pdf_solid_angle);
    }
    CHECK(lit > 500);
    CHECK(lit < 1500);
}

TEST_CASE("a triangle light is not even where a map changes its emission, or its normal may turn over") {
    SceneParts parts = empty_parts();
    add_rectangle(parts, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
    Material lamp = grey();
    lamp.ke = k_white;
    const auto is_even = [&](const Material& material) {
        return make_triangle_light(parts.mesh, 0, material, k_white).even;
    };
    CHECK(is_even(lamp));
    Material with_map = lamp, with_holes = lamp;
    with_map.map_ke.index = 0;
    with_holes.map_d.index = 0;
    CHECK_FALSE(is_even(with_map));
    CHECK_FALSE(is_even(with_holes));

    parts.mesh.normals = {{0, 0, 1}, {0, 0, 1}, {0.9f, 0, 0.1f}, {0, 0, 1}};
    CHECK(is_even(lamp));
    parts.mesh.normals[2] = {1, 0, -0.1f};
    CHECK_FALSE(is_even(lamp));
}

TEST_CASE("irradiance: below a rectangle it is Lambert's form factor, at any scale") {
    for (const float scale : {1e-3f, 1.0f, 1e4f}) {
        QuadLightSpec quad = ceiling_light({3, 3, 3});
        quad.corner = quad.corner * scale;
        quad.edge_u = quad.edge_u * scale;
        quad.edge_v = quad.edge_v * scale;
        const Scene scene = small_scene({quad});
        check_irradiance(scene, receiver({0, 0, 0}, {0, 1, 0}),
                         3 * k_pi64 * 4 * corner_form_factor(1, 1.5, 2));
    }
}

TEST_CASE("irradiance: from a sphere above the horizon it is π L sin² cos, near and far") {
    for (const float radius : {0.05f, 1.0f, 1.4f}) {
        const Scene scene = small_scene({SphereLightSpec{{0, 1.6f, 1.2f}, radius, {2, 2, 2}}});
        const SurfacePoint at = receiver({0, 0, 0}, normalize(Vec3{0, 1.6f, 1.2f}));
        check_irradiance(scene, at, 2 * k_pi64 * radius * radius / 4);
        if (radius < 1)
            check_irradiance(scene, receiver({0, 0, 0}, {0, 1, 0}), 2 * k_pi64 * radius * radius / 4 * 0.8);
    }
}

TEST_CASE("irradiance: a sun gives what it says, as a disc and as a direction") {
    for (const float angle : {0.0f, 0.53f, 40.0f}) {
        const Scene scene = small_scene({SunSpec{{0, 4, 3}, {5, 5, 5}, angle}});
        check_irradiance(scene, receiver({0, 0, 0}, {0, 0.8f, 0.6f}), 5);
        check_irradiance(scene, receiver({0, 0, 0}, {0, 1, 0}), 4);
    }
}

TEST_CASE("irradiance: a sky of radiance L gives π L, and so does an environment that is constant") {
    check_irradiance(small_scene({SkySpec{{2, 2, 2}}}), receiver({0, 0, 0}, {0, 0, 1}), 2 * k_pi64);
    check_irradiance(scene_with_environment(Image(16, 8, {2, 2, 2})), receiver({0, 0, 0}, {0, 0, 1}),
                     2 * k_pi64);
}

TEST_CASE("irradiance: a point light obeys the inverse square of the distance") {
    const Scene scene = small_scene({PointLightSpec{{0, 3, 4}, {50, 50, 50}}});
    check_irradiance(scene, receiver({0, 0, 0}, {0, 1, 0}), 50.0 / 25 * 0.6);
}

TEST_CASE("irradiance: lights of all kinds add up, also where those at infinity overlap") {
    const Scene scene =
        scene_with_environment(Image(16, 8, {0.25f, 0.25f, 0.25f}),
                               {ceiling_light(), SphereLightSpec{{6, 1, 0}, 0.5f, {10, 10, 10}},
                                PointLightSpec{{-9, 9, 0}, {81, 81, 81}}, SkySpec{{0.5f, 0.5f, 0.5f}},
                                SunSpec{{0, 0, 1}, {3, 3, 3}, 60}, SunSpec{{1, 0, 5}, {2, 2, 2}, 0}});
    const Vec3 normal = normalize(Vec3{0.2f, 1, 0.3f});
    const SurfacePoint at = receiver({0, 0, 0}, normal);

    // Each light alone, with all others in its way; the point and the suns are where nothing else is.
    double expected = 0;
    HashRng rng(9);
    Moments seen;  // By looking around uniformly: independent of the sampler under test.
    for (int i = 0; i < 400'000; ++i) {
        const float z = 1 - 2 * rng.next_float(), turn = rng.next_float();
        const double r = std::sqrt(std::max(0.0, 1 - double(z) * z));
        const Vec3 direction{float(r * std::cos(2 * k_pi64 * turn)), float(r * std::sin(2 * k_pi64 * turn)),
                             z};
        const double cosine = std::max(0.0f, dot(direction, normal));
        const auto hit = intersect(scene, {at.position, direction});
        const Rgb radiance =
            hit ? emitted_radiance(scene, *hit, -direction) : environment_radiance(scene, direction);
        seen.add(radiance.x * cosine * 4 * k_pi64);
    }
    expected = seen.mean() + 81.0 / 162 * dot(normalize(Vec3{-9, 9, 0}), normal) +
               2.0 * dot(normalize(Vec3{1, 0, 5}), normal);
    for (const LightSampling sampling : k_all) {
        const Moments found = estimate_irradiance(scene, sampling, at, 200'000);
        const double error = std::hypot(found.standard_error(), seen.standard_error());
        CHECK(error < 0.01 * expected);
        CHECK(std::abs(found.mean() - expected) < 4 * error);
    }
}

// ---- Densities.

TEST_CASE("what light sampling reports is what MIS computes for the same direction") {
    SceneParts parts = empty_parts();
    parts.envmap = gradient_picture();
    const Scene scene =
        small_scene(std::move(parts),
                    {ceiling_light(), SphereLightSpec{{4, 1, 0}, 0.8f, k_white},
                     SphereLightSpec{{-400, 50, 9}, 0.5f, {1e5f, 1e5f, 1e5f}}, SkySpec{{0.5f, 0.5f, 0.5f}},
                     SunSpec{{1, 0, 1}, k_white, 3}, EnvmapSpec{"test.hdr", 0.1f, 33}});
    const LightReference reference{{0.1f, -0.2f, 0.3f}, normalize(Vec3{1, 2, 1})};
    for (const LightSampling sampling : k_all) {
        HashRng rng(4);
        int compared = 0, differ = 0;
        for (int i = 0; i < 20'000; ++i) {
            const float u_pick = rng.next_float(), u = rng.next_float(), v = rng.next_float();
            const auto sample = sample_light(scene, sampling, reference, u_pick, {u, v});
            if (!sample || sample->delta) continue;
            CHECK(length(sample->direction) == doctest::Approx(1));
            const auto hit = intersect(scene, {reference.position, sample->direction});
            if (std::isinf(sample->distance) != !hit) continue;  // Another light stands between.
            if (hit && hit->light != sample->light) continue;
            ++compared;
            const double pdf = pdf_along(scene, sampling, reference, sample->direction);
            if (std::abs(pdf / sample->pdf_solid_angle - 1) > 1e-3) ++differ;
            const Rgb radiance = hit ? emitted_radiance(scene, *hit, -sample->direction)
                                     : environment_radiance(scene, sample->direction);
            CHECK(radiance == sample->radiance);
        }
        CHECK(compared > 10'000);
        // At the rim of a distant sphere the rounded direction meets another point, of another cosine.
        CHECK(differ < compared / 200);
    }
}

TEST_CASE("density and sampling of a triangle agree on whether it is near, wherever it is seen from") {
    const Scene scene = small_scene({ceiling_light()});
    for (const LightSampling sampling : k_all) {
        HashRng rng(9);
        int compared = 0, differ = 0;
        for (int i = 0; i < 20'000; ++i) {
            // From 1/500 of the lamp's size to ten times as far, below it and beside it.
            const float distance = 0.005f * std::pow(5000.0f, rng.next_float());
            const float x = 4 * rng.next_float() - 2, z = 4 * rng.next_float() - 2;
            const LightReference reference{{x, 2 - distance, z}, {0, 1, 0}};
            const float u_pick = rng.next_float(), u = rng.next_float(), v = rng.next_float();
            const auto sample = sample_light(scene, sampling, reference, u_pick, {u, v});
            if (!sample) continue;
            const auto hit = intersect(scene, {reference.position, sample->direction});
            if (!hit || hit->light != sample->light) continue;  // Past an edge, by rounding.
            ++compared;
            const double pdf = sample_light_pdf(scene, sampling, reference, *hit);
            if (std::abs(pdf / sample->pdf_solid_angle - 1) > 1e-3) ++differ;
        }
        CHECK(compared > 19'000);
        CHECK(differ < compared / 200);
    }
}

TEST_CASE("close to a lamp, by solid angle all samples count the same; by area, few outshine the others") {
    const Scene scene = small_scene({ceiling_light()});
    // In front of the lamp by 1/100, near a corner; of the quarters around it all but one are as good as infinite.
    const SurfacePoint at = receiver({-0.99f, 1.99f, -1.49f}, {0, 1, 0});
    double expected = 0;
    for (const double a : {0.01, 1.99})
        for (const double b : {0.01, 2.99}) expected += k_pi64 * corner_form_factor(a, b, 0.01);
    for (const LightSampling sampling : {LightSampling::power, LightSampling::tree}) {
        const Moments found = estimate_irradiance(scene, sampling, at, 20'000);
        CHECK(std::abs(found.mean() - expected) <= 4 * found.standard_error() + 1e-5 * expected);
        CHECK(found.standard_error() < 0.01 * expected);
    }
    const Moments by_area = estimate_irradiance(scene, LightSampling::area, at, 20'000);
    CHECK(std::abs(by_area.mean() - expected) <= 4 * by_area.standard_error());
    CHECK(by_area.standard_error() > 0.1 * expected);

    // Without the cosine of the surface there is nothing left to vary.
    HashRng rng(3);
    std::vector<double> values;
    for (int i = 0; i < 1000; ++i) {
        const float u_pick = rng.next_float(), u = rng.next_float(), v = rng.next_float();
        const auto sample =
            sample_light(scene, LightSampling::power, {at.position, at.shading_normal}, u_pick, {u, v});
        REQUIRE(sample);
        values.push_back(sample->radiance.x / sample->pdf_solid_angle);
    }
    CHECK(std::count(values.begin(), values.end(), values.front()) == std::ptrdiff_t(values.size()));
}

TEST_CASE("each light sampler draws directions with the density it reports") {
    struct Case {
        std::string name;
        Scene scene;
        LightSampling sampling = LightSampling::power;
    };
    // Of one light, `area` differs from `power` for spheres and for triangles that are near.
    const auto sphere = [] { return small_scene({SphereLightSpec{{1, 1, 1}, 1.2f, k_white}}); };
    const auto overlap = [] { return small_scene({ceiling_light(), SkySpec{{0.1f, 0.1f, 0.1f}}}); };
    std::vector<Case> cases;
    const auto quad = [](float height) {
        QuadLightSpec spec = ceiling_light();
        spec.corner.y = height;
        return small_scene({spec});
    };
    cases.push_back({"quad", quad(2)});
    cases.push_back({"quad by area", quad(2), LightSampling::area});
    cases.push_back({"quad that is far", quad(4)});
    cases.push_back({"quad that is close", quad(0.1f)});
    // Two triangles of unlike size, as one light.
    const auto trapezoid = [](float height) {
        SceneParts parts = empty_parts();
        Material lamp = grey();
        lamp.ke = k_white;
        const std::uint32_t material = add_material(parts, lamp);
        parts.mesh.positions = {{-1, -1, height}, {2, -1, height}, {0.2f, 1, height}, {-0.3f, 1, height}};
        parts.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
        parts.mesh.materials = {material, material};
        Scene scene = small_scene(std::move(parts), {EmissiveMtlSpec{}});
        REQUIRE(scene.lights.lights.size() == 1);
        return scene;
    };
    cases.push_back({"trapezoid that is near", trapezoid(0.7f)});
    cases.push_back({"trapezoid that is far", trapezoid(4)});
    cases.push_back({"sphere", sphere()});
    cases.push_back({"sphere by area", sphere(), LightSampling::area});
    cases.push_back({"sky", small_scene({SkySpec{k_white}})});
    cases.push_back({"sun", small_scene({SunSpec{{1, 2, 1}, k_white, 100}})});
    cases.push_back({"environment", scene_with_environment(gradient_picture())});
    cases.push_back({"sky behind quad", overlap()});
    cases.push_back({"sky behind quad, equal shares", overlap(), LightSampling::area});

    if (k_sanitized) cases.resize(6);
    const LightReference reference{{0.1f, 0, 0.2f}, {0, 0, 1}};
    for (const Case& each : cases) {
        CAPTURE(each.name);
        HashRng rng(7);
        const auto sample = [&](int) -> std::optional<Vec3> {
            const float u_pick = rng.next_float(), u = rng.next_float(), v = rng.next_float();
            const auto drawn = sample_light(each.scene, each.sampling, reference, u_pick, {u, v});
            // Of two lights in one direction, the density is that of the nearer one.
            if (!drawn || occluded(each.scene, shadow_ray(receiver(reference.position, {}), *drawn)))
                return std::nullopt;
            return drawn->direction;
        };
        const auto pdf = [&](Vec3 direction) {
            return pdf_along(each.scene, each.sampling, reference, direction);
        };
        const SphereTest test = chi_square_sphere(sample, pdf, 10'000, 6, 12, 3);
        CHECK(test.p_value > sidak_threshold(k_significance, int(cases.size())));
    }
}

// ---- What a sample may be.

TEST_CASE("a quad emits on the side of edge_u x edge_v only, and is black behind") {
    const Scene scene = small_scene({ceiling_light()});
    for (const LightSampling sampling : k_all) {
        CHECK(sample_light(scene, sampling, {{0, 0, 0}, {0, 1, 0}}, 0.3f, {0.5f, 0.5f}));
        CHECK_FALSE(sample_light(scene, sampling, {{0, 4, 0}, {0, -1, 0}}, 0.3f, {0.5f, 0.5f}));
        const auto behind = intersect(scene, {{0.2f, 4, 0}, {0, -1, 0}});
        REQUIRE(behind);
        CHECK(is_zero(emitted_radiance(scene, *behind, {0, 1, 0})));
        CHECK(sample_light_pdf(scene, sampling, {{0.2f, 4, 0}, {0, -1, 0}}, *behind) == 0);
    }
    const auto front = intersect(scene, {{0.2f, 0, 0}, {0, 1, 0}});
    REQUIRE(front);
    CHECK(emitted_radiance(scene, *front, {0, -1, 0}) == k_white);
}

TEST_CASE("materials emit from both sides unless the scene says otherwise") {
    for (const bool two_sided : {true, false}) {
        SceneParts parts = empty_parts();
        Material lamp = grey();
        lamp.ke = {2, 2, 2};
        add_rectangle(parts, {-1, 2, -1.5f}, {2, 0, 0}, {0, 0, 3}, add_material(parts, lamp));
        const Scene scene = small_scene(std::move(parts), {EmissiveMtlSpec{two_sided}});
        const double below = 2 * k_pi64 * 4 * corner_form_factor(1, 1.5, 2);
        check_irradiance(scene, receiver({0, 0, 0}, {0, 1, 0}), below);
        check_irradiance(scene, receiver({0, 4, 0}, {0, -1, 0}), two_sided ? below : 0);
    }
}

TEST_CASE("a textured emitter shines where its texture does, and through no hole") {
    // Left half white, right half black; the ramp between them is one of 64 texels wide, and symmetric.
    Image8 halves{64, 1, 1, std::vector<std::uint8_t>(64)};
    std::fill_n(halves.bytes.begin(), 32, std::uint8_t(255));
    for (const bool as_hole : {false, true}) {
        SceneParts parts = empty_parts();
        parts.textures.emplace_back(as_hole ? TextureUsage::grey : TextureUsage::colour, halves);
        Material lamp = grey();
        lamp.ke = {2, 2, 2};
        (as_hole ? lamp.map_d : lamp.map_ke).index = 0;
        add_rectangle(parts, {-1, 2, -1.5f}, {2, 0, 0}, {0, 0, 3}, add_material(parts, lamp));
        const Scene scene = small_scene(std::move(parts), {EmissiveMtlSpec{}});
        CHECK(has_cutouts(scene) == as_hole);

        // Below the border between the halves, each of them has the share of half the form factor. The
        // texture repeats, so at the outer border there is a ramp as well.
        const double expected = 2 * k_pi64 * 2 * corner_form_factor(1, 1.5, 2);
        for (const LightSampling sampling : k_all) {
            const Moments found =
                estimate_irradiance(scene, sampling, receiver({0, 0, 0}, {0, 1, 0}), 40'000);
            CHECK(found.mean() == doctest::Approx(expected).epsilon(0.02));
        }
        const auto dark = intersect(scene, {{0.5f, 0, 0}, {0, 1, 0}});
        if (as_hole)
            CHECK_FALSE(dark);
        else
            CHECK(is_zero(emitted_radiance(scene, *dark, {0, -1, 0})));
    }
}

TEST_CASE("two copies of an emitter shine once, as a ray meets one of them only") {
    SceneParts parts = empty_parts();
    Material lamp = grey();
    lamp.ke = {1, 1, 1};
    const std::uint32_t material = add_material(parts, lamp);
    for (int copy = 0; copy < 2; ++copy) add_rectangle(parts, {-1, 2, -1.5f}, {2, 0, 0}, {0, 0, 3}, material);
    const Scene scene = small_scene(std::move(parts), {EmissiveMtlSpec{}});
    CHECK(scene.lights.lights.size() == 1);
    check_irradiance(scene, receiver({0, 0, 0}, {0, 1, 0}), k_pi64 * 4 * corner_form_factor(1, 1.5, 2));
}

TEST_CASE("from inside, a sphere is dark; a hair outside it is half the world") {
    const Scene scene = small_scene({SphereLightSpec{{0, 0, 0}, 2, k_white}});
    for (const LightSampling sampling : k_all) {
        for (int i = 0; i < 100; ++i)
            CHECK_FALSE(sample_light(scene, sampling, {{0, 1, 0}, {0, 1, 0}}, 0.5f,
                                     {0.005f + 0.01f * float(i), 0.37f}));
        const auto wall = intersect(scene, {{0, 1, 0}, {0, 1, 0}});
        REQUIRE(wall);
        CHECK(is_zero(emitted_radiance(scene, *wall, {0, -1, 0})));
        CHECK(sample_light_pdf(scene, sampling, {{0, 1, 0}, {0, 1, 0}}, *wall) == 0);
    }
    const float near = 2.00002f;
    const Moments found =
        estimate_irradiance(scene, LightSampling::power, receiver({0, near, 0}, {0, -1, 0}), 20'000);
    CHECK(std::abs(found.mean() - k_pi64 * 4 / double(near * near)) < 4 * found.standard_error());
}

TEST_CASE("shadow rays meet what stands between, and neither end") {
    SceneParts parts = empty_parts();
    add_rectangle(parts, {-5, 0, -5}, {0, 0, 10}, {10, 0, 0});  // A floor to stand on.
    add_rectangle(parts, {-5, 2, -5}, {10, 0, 0}, {0, 0, 10});  // A ceiling, the light's plane.
    add_rectangle(parts, {0, 1, -5}, {10, 0, 0}, {0, 0, 10});   // A shelf over the half x > 0.
    const Scene scene =
        small_scene(std::move(parts), {QuadLightSpec{{-4, 2, -1}, {1, 0, 0}, {0, 0, 2}, k_white}});
    const auto blocked = [&](float x) {
        const auto floor = intersect(scene, {{x, 0.5f, 0.1f}, {0, -1, 0}});
        REQUIRE(floor);
        const LightReference reference{floor->point.position, {0, 1, 0}};
        int hits = 0;
        for (int i = 0; i < 100; ++i) {
            const auto sample =
                sample_light(scene, LightSampling::power, reference, 0.01f * float(i), {0.3f, 0.6f});
            REQUIRE(sample);
            hits += occluded(scene, shadow_ray(floor->point, *sample));
        }
        return hits;
    };
    CHECK(blocked(-3) == 0);
    CHECK(blocked(4) == 100);
}

TEST_CASE("without lights there is no sample, no density, no crash, and one warning") {
    LogCapture log;
    const Scene scene = small_scene({SkySpec{{0, 0, 0}}});
    REQUIRE(log.warnings.size() == 1);
    CHECK(log.warnings[0].find("black") != std::string::npos);
    for (const LightSampling sampling : k_all) {
        CHECK_FALSE(sample_light(scene, sampling, {{0, 0, 0}, {0, 1, 0}}, 0.5f, {0.5f, 0.5f}));
        CHECK(sample_environment_pdf(scene, sampling, {{0, 0, 0}, {0, 1, 0}}, {0, 1, 0}) == 0);
    }
    CHECK(is_zero(environment_radiance(scene, {0, 1, 0})));
}
