#include "pathscope/scene/light_tree.hpp"

#include <vector>

#include "pathscope/math/random.hpp"
#include "pathscope/sampling/warp.hpp"
#include "pathscope/scene/light_sampling.hpp"
#include "small_scenes.hpp"
#include "statistics.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr std::uint32_t k_steps = 1u << 24;

Vec3 random_point(HashRng& rng, float size) {
    return {size * (rng.next_float() - 0.5f), size * (rng.next_float() - 0.5f),
            size * (rng.next_float() - 0.5f)};
}
Vec3 random_direction(HashRng& rng) {
    const float u = rng.next_float(), v = rng.next_float();
    return sample_uniform_sphere({u, v});
}
LightReference random_reference(HashRng& rng, float size) {
    const Vec3 position = random_point(rng, size);
    return {position, random_direction(rng)};
}

/// A triangle somewhere in a cube, and the corners that the tree does not see.
struct SmallLight {
    LightBounds bounds;
    std::array<Vec3, 3> corners;
};
SmallLight random_light(HashRng& rng, float cube, float size) {
    SmallLight light;
    const Vec3 middle = random_point(rng, cube);
    for (Vec3& corner : light.corners) {
        corner = middle + random_point(rng, size);
        light.bounds.box.add(corner);
    }
    const Vec3 normal = cross(light.corners[1] - light.corners[0], light.corners[2] - light.corners[0]);
    light.bounds.normal = normalize(normal);
    light.bounds.side = ShinesTo(int(3 * rng.next_float()));
    light.bounds.intensity = std::exp2(20 * rng.next_float() - 10);
    return light;
}
std::vector<SmallLight> random_lights(int count, std::uint32_t seed, float size = 0.5f) {
    HashRng rng(seed);
    std::vector<SmallLight> lights;
    for (int i = 0; i < count; ++i) lights.push_back(random_light(rng, 10, size));
    return lights;
}
LightTree tree_of(const std::vector<SmallLight>& lights) {
    std::vector<LightBounds> bounds;
    for (const SmallLight& light : lights) bounds.push_back(light.bounds);
    return LightTree::make(bounds);
}

/// By trying some of its points: both cosines positive, by more than rounding.
bool reaches(const SmallLight& light, const LightReference& reference, HashRng& rng) {
    for (int i = 0; i < 8; ++i) {
        const float u = rng.next_float(), v = rng.next_float();
        const Vec2 b = sample_triangle({u, v});
        const Vec3 point =
            light.corners[0] * (1 - b.x - b.y) + light.corners[1] * b.x + light.corners[2] * b.y;
        const Vec3 to_light = normalize(point - reference.position);
        float facing = -dot(to_light, light.bounds.normal);
        if (light.bounds.side == ShinesTo::both_sides) facing = std::abs(facing);
        if (light.bounds.side == ShinesTo::everywhere) facing = 1;
        if (dot(to_light, reference.normal) > 1e-5f && facing > 1e-5f) return true;
    }
    return false;
}

/// A hall of small lamps that face in all directions; some shine from both sides, some are spheres.
Scene hall_of_lamps(std::vector<LightSpec> more = {}) {
    HashRng rng(3);
    SceneParts parts = empty_parts();
    for (int i = 0; i < 40; ++i) {
        const Vec3 corner = random_point(rng, 8), u = random_direction(rng) * 0.3f;
        const float radiance = std::exp2(6 * rng.next_float());
        more.push_back(
            QuadLightSpec{corner, u, random_direction(rng) * 0.3f, {radiance, radiance, radiance}});
    }
    more.push_back(SphereLightSpec{{0, 1, 0}, 0.2f, {5, 5, 5}});
    more.push_back(PointLightSpec{{1, 0, 1}, {4, 4, 4}});
    return small_scene(std::move(parts), std::move(more));
}

}  // namespace

TEST_CASE("probabilities of lights that all can be reached add up to one, but for a step or two per node") {
    for (const int count : {2, 9, 100, 5000}) {
        auto lights = random_lights(count, std::uint32_t(count));
        for (SmallLight& light : lights) light.bounds.side = ShinesTo::everywhere;
        const LightTree tree = tree_of(lights);
        const LightReference reference{{0, -20, 0}, {0, 1, 0}};
        for (const std::uint32_t steps : {std::uint32_t(count), 12'345u, k_steps}) {
            std::uint64_t sum = 0;
            for (std::uint32_t light = 0; light < std::uint32_t(count); ++light)
                sum += tree.steps_to(reference, light, steps);
            CHECK(sum <= steps);
            CHECK(sum + 3 * std::uint64_t(count) >= steps);
        }
    }
}

TEST_CASE("the steps of all lights are never more than the steps given, wherever the point is") {
    for (const int count : {1, 2, 7, 8, 9, 64, 65, 700}) {
        CAPTURE(count);
        const auto lights = random_lights(count, std::uint32_t(count));
        const LightTree tree = tree_of(lights);
        CHECK(int(tree.light_count()) == count);
        HashRng rng(1);
        for (int i = 0; i < 50; ++i) {
            const LightReference reference = random_reference(rng, i % 2 ? 10.0f : 1000.0f);
            for (const std::uint32_t steps : {std::uint32_t(count), 12'345u, k_steps}) {
                std::uint64_t sum = 0;
                for (std::uint32_t light = 0; light < std::uint32_t(count); ++light)
                    sum += tree.steps_to(reference, light, steps);
                // Steps may lead nowhere: to children none of whose children can be reached, as it turns out nearer by.
                CHECK(sum <= steps);
                if (count == 1) CHECK(sum == steps);
            }
        }
    }
}

TEST_CASE("what is picked is what is reported: every step of small shares, and chi-square of large ones") {
    const int count = 90;
    const LightTree tree = tree_of(random_lights(count, 5));
    HashRng rng(2);
    for (int i = 0; i < 20; ++i) {
        const LightReference reference = random_reference(rng, 12);
        const std::uint32_t steps = 5000;
        std::vector<std::uint32_t> found(count);
        for (std::uint32_t step = 0; step < steps; ++step)
            if (const auto pick = tree.pick(reference, step, steps)) {
                ++found[pick->light];
                CHECK(pick->steps == tree.steps_to(reference, pick->light, steps));
            }
        for (std::uint32_t light = 0; light < std::uint32_t(count); ++light)
            CHECK(found[light] == tree.steps_to(reference, light, steps));
    }
}

TEST_CASE("drawn frequencies pass a chi-square test against the probabilities, lights at infinity included") {
    const Scene scene = hall_of_lamps({SkySpec{{0.5f, 0.5f, 0.5f}}, SunSpec{{1, 2, 1}, {3, 3, 3}, 0.5f}});
    REQUIRE_FALSE(scene.lights.tree.empty());
    HashRng rng(8);
    const int points = 10, draws = 50'000;
    for (int i = 0; i < points; ++i) {
        const LightReference reference = random_reference(rng, 8);
        std::vector<double> found(scene.lights.lights.size());
        int nothing = 0;
        for (int n = 0; n < draws; ++n) {
            const auto pick = pick_light(scene.lights, LightSampling::tree, reference, rng.next_float());
            if (!pick)
                ++nothing;
            else
                ++found[pick->light];
        }
        double statistic = 0, sum = 0, rest_expected = 0, rest_found = 0;
        int degrees = 0;
        for (std::uint32_t light = 0; light < found.size(); ++light) {
            const double p = pick_probability(scene.lights, LightSampling::tree, reference, light);
            sum += p;
            if (p == 0) CHECK(found[light] == 0);
            if (p * draws < 10) {
                rest_expected += p * draws;
                rest_found += found[light];
                continue;
            }
            statistic += (found[light] - p * draws) * (found[light] - p * draws) / (p * draws);
            ++degrees;
        }
        CHECK(sum <= 1 + 1e-6);
        rest_expected += (1 - sum) * draws;
        rest_found += nothing;
        if (rest_expected >= 10) {
            statistic += (rest_found - rest_expected) * (rest_found - rest_expected) / rest_expected;
            ++degrees;
        }
        CHECK(chi_square_p_value(statistic, degrees - 1) > sidak_threshold(k_significance, points));
    }
}

TEST_CASE("a light that can reach the point has a probability, however faint or far") {
    for (const float size : {0.01f, 0.5f, 8.0f}) {
        const auto lights = random_lights(200, 17, size);
        const LightTree tree = tree_of(lights);
        HashRng rng(4);
        int reached = 0, dark = 0;
        for (int i = 0; i < 500; ++i) {
            const LightReference reference = random_reference(rng, i % 3 ? 12.0f : 1e5f);
            for (std::uint32_t light = 0; light < lights.size(); ++light) {
                const std::uint32_t steps = tree.steps_to(reference, light, k_steps);
                dark += steps == 0;
                if (!reaches(lights[light], reference, rng)) continue;
                ++reached;
                CHECK(steps > 0);
            }
        }
        CHECK(reached > 10'000);
        CHECK(dark > 0);  // So that the test above means something.
    }
}

TEST_CASE("a single light has probability 1") {
    const LightTree tree = tree_of(random_lights(1, 6));
    HashRng rng(1);
    for (int i = 0; i < 100; ++i) {
        const LightReference reference = random_reference(rng, 20);
        CHECK(tree.steps_to(reference, 0, k_steps) == k_steps);
        CHECK(tree.pick(reference, k_steps - 1, k_steps)->steps == k_steps);
    }
}

TEST_CASE("of two equal lamps, one ten times as far is picked a hundred times less often") {
    std::vector<LightBounds> lamps(2);
    lamps[0].box = {{0, 1, 0}, {0, 1, 0}};
    lamps[1].box = {{0, 10, 0}, {0, 10, 0}};
    lamps[0].intensity = lamps[1].intensity = 3;
    const LightTree tree = LightTree::make(lamps);
    const LightReference reference{{0, 0, 0}, {0, 1, 0}};
    CHECK(tree.steps_to(reference, 0, k_steps) == doctest::Approx(k_steps * 100.0 / 101).epsilon(1e-5));
    CHECK(tree.irradiance(reference) == doctest::Approx(3 + 0.03).epsilon(1e-5));
    // Both below the horizon: nothing to pick.
    CHECK_FALSE(tree.pick({{0, 0, 0}, {0, -1, 0}}, 0, k_steps));
}

TEST_CASE("lights in one place, at the point itself, and of the extremes of floats are picked as well") {
    std::vector<LightBounds> lamps(300);
    for (std::size_t i = 0; i < lamps.size(); ++i) {
        lamps[i].box = {{1, 1, 1}, {1, 1, 1}};
        lamps[i].intensity = i == 7 ? 1e30 : 1e-30;
    }
    const LightTree tree = LightTree::make(lamps);
    for (const LightReference& reference :
         {LightReference{{1, 1, 1}, {0, 1, 0}}, {{0, 0, 0}, {0, 1, 0}}, {{-1e15f, 0, 0}, {1, 0, 0}}}) {
        std::uint64_t sum = 0;
        for (std::uint32_t light = 0; light < lamps.size(); ++light) {
            const std::uint32_t steps = tree.steps_to(reference, light, k_steps);
            CHECK(steps > 0);
            sum += steps;
        }
        CHECK(sum <= k_steps);
        CHECK(tree.steps_to(reference, 7, k_steps) > k_steps / 2);
    }
}

TEST_CASE("scenes with few lights have no tree: they pick by power, with the same bits") {
    const Scene scene = small_scene({PointLightSpec{{0, 3, 4}, {50, 50, 50}}, SkySpec{{1, 1, 1}}});
    CHECK(scene.lights.tree.empty());
    const LightReference reference{{0, 0, 0}, {0, 1, 0}};
    for (int i = 0; i < 100; ++i) {
        const float u = 0.01f * float(i);
        const auto by_tree = pick_light(scene.lights, LightSampling::tree, reference, u);
        const auto by_power = pick_light(scene.lights, LightSampling::power, reference, u);
        REQUIRE(by_tree);
        CHECK(by_tree->light == by_power->light);
        CHECK(by_tree->probability == by_power->probability);
        CHECK(pick_probability(scene.lights, LightSampling::tree, reference, by_tree->light) ==
              by_tree->probability);
    }
}

TEST_CASE("irradiance: by the tree as by power, within four standard errors, and with less noise") {
    const Scene scene = hall_of_lamps({SkySpec{{0.2f, 0.2f, 0.2f}}});
    HashRng rng(12);
    double tree_variance = 0, power_variance = 0;
    for (int i = 0; i < 10; ++i) {
        const LightReference reference = random_reference(rng, 6);
        SurfacePoint at;
        at.position = reference.position;
        at.geometric_normal = at.shading_normal = reference.normal;
        std::array<Moments, 2> found;
        for (int n = 0; n < 20'000; ++n) {
            const float u_pick = rng.next_float(), u = rng.next_float(), v = rng.next_float();
            for (const LightSampling sampling : {LightSampling::power, LightSampling::tree}) {
                const auto sample = sample_light(scene, sampling, reference, u_pick, {u, v});
                double value = 0;
                if (sample && !occluded(scene, shadow_ray(at, *sample)))
                    value = double(sample->radiance.x) *
                            std::max(0.0f, dot(sample->direction, reference.normal)) /
                            sample->pdf_solid_angle;
                found[sampling == LightSampling::tree].add(value);
            }
        }
        const double error = std::hypot(found[0].standard_error(), found[1].standard_error());
        CHECK(std::abs(found[0].mean() - found[1].mean()) < 4 * error);
        power_variance += found[0].standard_error() * found[0].standard_error();
        tree_variance += found[1].standard_error() * found[1].standard_error();
    }
    CHECK(tree_variance < 0.5 * power_variance);
}
