#include "pathscope/integrator/path_batch.hpp"

#include "integrator/estimator_scenes.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// A room of mirrors, for paths with a long specular start, and a lamp in it.
Scene hall_of_mirrors() {
    SceneParts parts = empty_parts();
    Material mirror;
    mirror.kind = MaterialKind::mirror;
    mirror.ks = {0.98f, 0.98f, 0.98f};
    add_box(parts, {-1, -1, -1}, {1, 1, 1}, add_material(parts, mirror));
    add_box(parts, {-0.3f, -0.9f, -0.3f}, {-0.2f, -0.8f, -0.2f},
            add_material(parts, lambert({0.5f, 0.5f, 0.5f}, {3, 2, 1})));
    return small_scene(std::move(parts), {EmissiveMtlSpec{}});
}

std::vector<TransportSettings> all_levers() {
    std::vector<TransportSettings> list;
    for (const Setting setting : {Setting::best, Setting::textbook})
        for (const MisHeuristic mis : {MisHeuristic::power, MisHeuristic::balance, MisHeuristic::off})
            for (const auto& [roulette, name] : k_roulette_names)
                for (const int first_bounce : {0, 3})
                    for (const int max_bounces : {0, 1, 2}) {
                        TransportSettings settings = make_settings(setting);
                        settings.mis = mis;
                        settings.roulette.kind = roulette;
                        settings.roulette.first_bounce = first_bounce;
                        settings.max_bounces = max_bounces;
                        settings.light_samples = int(list.size() % 4);  // 0 = one or two.
                        list.push_back(settings);
                    }
    return list;
}

struct Tally {
    int lit_direct = 0, lit_indirect = 0;
    std::uint64_t rays_apart = 0, rays_together = 0;
};

/// Compares every sample of a small picture, bit by bit: both parts of a batch, and each part alone.
Tally compare(const Scene& scene, const TransportSettings& settings, int samples) {
    Tally tally;
    const int size = 8;
    const CameraFrame camera = room_camera(size);
    PathBatch both(scene, camera, settings, {true, true}),
        direct_only(scene, camera, settings, {true, false}),
        indirect_only(scene, camera, settings, {false, true});
    std::uint64_t rays_direct = 0, rays_indirect = 0;
    std::vector<PartsRadiance> expected;
    const auto check_batch = [&] {
        const auto together = both.trace(tally.rays_together);
        const auto direct = direct_only.trace(rays_direct), indirect = indirect_only.trace(rays_indirect);
        REQUIRE(together.size() == expected.size());
        for (std::size_t i = 0; i < expected.size(); ++i) {
            REQUIRE(together[i].direct == expected[i].direct);
            REQUIRE(together[i].indirect == expected[i].indirect);
            REQUIRE(direct[i].direct == expected[i].direct);
            REQUIRE(direct[i].indirect == Rgb{});
            REQUIRE(indirect[i].direct == Rgb{});
            REQUIRE(indirect[i].indirect == expected[i].indirect);
        }
        expected.clear();
    };
    for (int i = 0; i < size * size; ++i)
        for (int sample = 0; sample < samples; ++sample) {
            const int x = i % size, y = i / size;
            const PixelSampler sampler(settings.sampler, 5, x, y, std::uint32_t(sample));
            const Ray ray = room_ray(x, y, size, sampler);
            expected.push_back(
                {estimate_radiance<LightPart::direct>(scene, settings, ray, sampler, tally.rays_apart),
                 estimate_radiance<LightPart::indirect>(scene, settings, ray, sampler, tally.rays_apart)});
            tally.lit_direct += !is_zero(expected.back().direct);
            tally.lit_indirect += !is_zero(expected.back().indirect);
            for (PathBatch* batch : {&both, &direct_only, &indirect_only}) batch->add(x, y, sampler);
            if (both.full()) check_batch();
        }
    if (!expected.empty()) check_batch();
    CHECK(rays_direct + rays_indirect == tally.rays_apart);
    return tally;
}

}  // namespace

TEST_CASE(
    "samples side by side, both parts or one, are the samples one by one, to the last bit, with every "
    "lever") {
    const Scene room = small_room(), mirrors = hall_of_mirrors(), box = furnace(0.5f, 0.8f),
                lamps = room_of_lamps();
    for (const Scene* scene : {&room, &mirrors, &box, &lamps})
        for (const TransportSettings& settings : all_levers()) {
            CAPTURE(name_of(settings.mis));
            CAPTURE(name_of(settings.roulette.kind));
            CAPTURE(settings.light_samples);
            CAPTURE(settings.max_bounces);
            const Tally tally = compare(*scene, settings, k_sanitized ? 4 : 32);
            CHECK(tally.lit_direct > 0);
            // Of mirrors alone all light is direct; one bounce is direct as well.
            if (scene != &mirrors && settings.max_bounces != 1) CHECK(tally.lit_indirect > 0);
            CHECK(tally.rays_together <= tally.rays_apart);
        }
}

TEST_CASE("one walk traces fewer rays than two") {
    const Tally tally = compare(small_room(), make_settings(Setting::best), 32);
    CHECK(double(tally.rays_together) < 0.95 * double(tally.rays_apart));
}
