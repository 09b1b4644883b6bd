#include "pathscope/integrator/path_estimator.hpp"

#include <array>
#include <cmath>

#include "integrator/estimator_scenes.hpp"
#include "integrator/pixel_moments.hpp"
#include "pathscope/sampling/warp.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// Light by number of scatterings, direct and indirect together.
struct BounceProbe {
    std::array<float, 64> radiance{};
    void contribution(int bounce, Rgb value) {
        if (bounce < int(radiance.size())) radiance[std::size_t(bounce)] += value.x;
    }
};

/// The oracle: a plain recursive path tracer. No light sampling, no split, no roulette but a fixed one; what it shares
/// with the estimator is the scene's queries and the sampling of one BSDF.
Rgb radiance_by_recursion(const Scene& scene, const Ray& ray, HashRng& rng) {
    const auto hit = intersect(scene, ray);
    if (!hit) return environment_radiance(scene, ray.direction);
    const Vec3 outgoing = -ray.direction;
    const Rgb emitted = emitted_radiance(scene, *hit, outgoing);
    constexpr float k_survival = 0.9f;
    if (rng.next_float() >= k_survival) return emitted;
    const ShadedPoint shaded = shade_point(scene, *hit, outgoing);
    const float lobe = rng.next_float(), u = rng.next_float(), v = rng.next_float();
    const auto sample = sample_bsdf(shaded.bsdf, shaded.frame.to_local(outgoing), lobe, {u, v});
    if (!sample) return emitted;
    const Vec3 incoming = shaded.frame.to_world(sample->incoming);
    if (!is_consistent(shaded, incoming)) return emitted;
    const Ray next = spawn_ray(hit->point, incoming);
    return emitted + sample->weight * (1 / k_survival) * radiance_by_recursion(scene, next, rng);
}

template <class Settings>
std::vector<PixelMoments> room_picture(const Scene& scene, const Settings& settings, int size, int samples) {
    return picture(size, samples, [&](int x, int y, std::uint32_t sample) {
        std::uint64_t rays = 0;
        // Independent samples: the z-test needs their variance, and low-discrepancy points hide it.
        const PixelSampler sampler(SamplerKind::independent, 5, x, y, sample);
        const Ray ray = room_ray(x, y, size, sampler);
        return estimate_radiance<LightPart::direct>(scene, settings, ray, sampler, rays) +
               estimate_radiance<LightPart::indirect>(scene, settings, ray, sampler, rays);
    });
}

}  // namespace

TEST_CASE(
    "furnace: a closed box with emission Le and albedo rho has radiance Le / (1 - rho), and Le rho^n per "
    "bounce") {
    const float le = 0.75f;
    const int samples = k_sanitized ? 20'000 : 60'000;
    for (const float rho : {0.2f, 0.5f, 0.8f}) {
        const Scene scene = furnace(le, rho);
        for (const Setting setting : {Setting::best, Setting::textbook}) {
            TransportSettings settings = make_settings(setting);
            settings.sampler = SamplerKind::independent;
            Moments total;
            std::array<Moments, 6> bounces;
            for (int i = 0; i < samples; ++i) {
                const PixelSampler sampler(settings.sampler, 11, i % 256, i / 256, 0);
                const Vec3 direction = sample_uniform_sphere(sampler.get_2d(k_pixel_dimension));
                const Ray ray{{0.1f, -0.2f, 0.3f}, direction};
                BounceProbe probe;
                std::uint64_t rays = 0;
                const Rgb direct =
                    estimate_radiance<LightPart::direct>(scene, settings, ray, sampler, rays, probe);
                const Rgb indirect =
                    estimate_radiance<LightPart::indirect>(scene, settings, ray, sampler, rays, probe);
                total.add(direct.x + indirect.x);
                for (std::size_t n = 0; n < bounces.size(); ++n) bounces[n].add(probe.radiance[n]);
            }
            CAPTURE(rho);
            CAPTURE(name_of(setting));
            // What is left of rounding: 1e-5 of the answer, far below a standard error.
            const double answer = le / (1 - rho);
            CHECK(std::abs(total.mean() - answer) < 4 * total.standard_error() + 1e-5 * answer);
            for (std::size_t n = 0; n < bounces.size(); ++n) {
                const double light = le * std::pow(rho, n);
                CHECK(std::abs(bounces[n].mean() - light) < 4 * bounces[n].standard_error() + 1e-5 * light);
            }
        }
    }
}

TEST_CASE("direct + indirect is what a plain recursive path tracer finds, in both settings") {
    const Scene scene = small_room();
    const int size = 6, samples = k_sanitized ? 500 : 12'000;
    const auto oracle = picture(size, 2 * samples, [&](int x, int y, std::uint32_t sample) {
        HashRng rng(hash_combine(std::uint32_t(y * size + x), sample));
        return radiance_by_recursion(
            scene, room_ray(x, y, size, PixelSampler(SamplerKind::independent, 6, x, y, sample)), rng);
    });
    const auto best = room_picture(scene, make_settings(Setting::best), size, samples);
    const auto textbook = room_picture(scene, make_settings(Setting::textbook), size, samples);
    CHECK(same_mean(best, oracle));
    CHECK(same_mean(textbook, oracle));
    CHECK(same_mean(best, textbook));
}

TEST_CASE("a lamp behind a veil is seen through it, with every way of weighing") {
    SceneParts parts = empty_parts();
    Material veil = lambert({0.8f, 0.8f, 0.8f});
    veil.opacity = 0.4f;
    add_rectangle(parts, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, add_material(parts, veil));
    add_rectangle(parts, {-1, -1, -0.5f}, {2, 0, 0}, {0, 2, 0}, add_material(parts, lambert({}, {1, 1, 1})));
    const Scene scene = small_scene(std::move(parts), {EmissiveMtlSpec{}});
    const Ray ray{{0, 0, 1}, {0, 0, -1}};
    for (const MisHeuristic mis : {MisHeuristic::off, MisHeuristic::balance, MisHeuristic::power}) {
        CAPTURE(name_of(mis));
        TransportSettings settings = make_settings(Setting::best);
        settings.sampler = SamplerKind::independent;
        settings.mis = mis;
        Moments seen;
        for (int i = 0; i < 4000; ++i) {
            const PixelSampler sampler(settings.sampler, 3, i, 0, 0);
            std::uint64_t rays = 0;
            seen.add(estimate_radiance<LightPart::direct>(scene, settings, ray, sampler, rays).x);
        }
        // The veil is lit from behind, so it is black itself: what comes is what passes it.
        CHECK(std::abs(seen.mean() - 0.6) < 4 * seen.standard_error());
    }
}

TEST_CASE("every lever alone leaves the image as it is") {
    const Scene scene = small_room();
    const int size = 4, samples = k_sanitized ? 500 : 10'000;
    const auto best = room_picture(scene, make_settings(Setting::best), size, samples);
    std::vector<TransportSettings> variants(8, make_settings(Setting::best));
    variants[0].light = LightSampling::area;
    variants[1].hemisphere = HemisphereSampling::uniform;
    variants[2].hemisphere = HemisphereSampling::cosine;
    variants[3].mis = MisHeuristic::off;
    variants[4].mis = MisHeuristic::balance;
    variants[5].roulette.kind = Roulette::constant;
    variants[6].light_samples = 3;
    variants[7].roulette.kind = Roulette::efficiency;
    for (std::size_t i = 0; i < variants.size(); ++i) {
        CAPTURE(i);
        CHECK(same_mean(room_picture(scene, variants[i], size, samples), best));
    }
}

TEST_CASE("in a room of many lamps the tree leaves the image as it is, and takes noise out of it") {
    const Scene scene = room_of_lamps();
    REQUIRE_FALSE(scene.lights.tree.empty());
    const int size = 4, samples = k_sanitized ? 500 : 10'000;
    TransportSettings by_tree = make_settings(Setting::best), by_power = by_tree;
    by_power.light = LightSampling::power;
    const auto tree = room_picture(scene, by_tree, size, samples),
               power = room_picture(scene, by_power, size, samples);
    CHECK(same_mean(tree, power));
    double tree_variance = 0, power_variance = 0;
    for (std::size_t i = 0; i < tree.size(); ++i) {
        tree_variance += tree[i][0].standard_error() * tree[i][0].standard_error();
        power_variance += power[i][0].standard_error() * power[i][0].standard_error();
    }
    CHECK(tree_variance < 0.8 * power_variance);
}

TEST_CASE("the tests above can fail: a light twice as bright, or a lost bounce, is another image") {
    const Scene scene = small_room();
    TransportSettings short_paths = make_settings(Setting::best);
    short_paths.max_bounces = 3;
    const int samples = k_sanitized ? 2000 : 10'000;
    const auto best = room_picture(scene, make_settings(Setting::best), 4, samples);
    CHECK_FALSE(same_mean(room_picture(scene, short_paths, 4, samples), best));
}

TEST_CASE("max_bounces leaves out exactly the light that scattered more often") {
    const Scene scene = small_room();
    for (std::uint32_t sample = 0; sample < 500; ++sample) {
        const PixelSampler sampler(SamplerKind::sobol, 9, 3, 4, sample);
        const Ray ray = room_ray(3, 4, 8, sampler);
        TransportSettings settings = make_settings(Setting::best);
        BounceProbe all, limited;
        std::uint64_t rays = 0;
        (void)estimate_radiance<LightPart::direct>(scene, settings, ray, sampler, rays, all);
        (void)estimate_radiance<LightPart::indirect>(scene, settings, ray, sampler, rays, all);
        settings.max_bounces = 4;
        (void)estimate_radiance<LightPart::direct>(scene, settings, ray, sampler, rays, limited);
        (void)estimate_radiance<LightPart::indirect>(scene, settings, ray, sampler, rays, limited);
        for (std::size_t n = 0; n < all.radiance.size(); ++n)
            CHECK(limited.radiance[n] == (n <= 4 ? all.radiance[n] : 0));
    }
}

TEST_CASE("what mirrors and glass show of a light is direct, and a caustic is indirect") {
    // A mirror floor under a light: the camera looks into the mirror.
    SceneParts parts = empty_parts();
    Material mirror;
    mirror.kind = MaterialKind::mirror;
    mirror.ks = {1, 1, 1};
    add_rectangle(parts, {-5, 0, -5}, {0, 0, 10}, {10, 0, 0}, add_material(parts, mirror));
    const Scene scene = small_scene(std::move(parts), {SkySpec{{2, 3, 4}}});
    const PixelSampler sampler(SamplerKind::sobol, 1, 0, 0, 0);
    const Ray ray{{0, 1, 0}, normalize(Vec3{0.1f, -1, 0})};
    std::uint64_t rays = 0;
    const TransportSettings settings = make_settings(Setting::best);
    CHECK(estimate_radiance<LightPart::direct>(scene, settings, ray, sampler, rays) == Rgb{2, 3, 4});
    CHECK(estimate_radiance<LightPart::indirect>(scene, settings, ray, sampler, rays) == Rgb{});
}
