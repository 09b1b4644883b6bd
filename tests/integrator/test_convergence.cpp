/// The two settings agree on whole scenes: per pixel, by a z-test with Sidak's correction.
///
/// The test is valid where the means are normally distributed, so each case takes as many samples as make the least
/// likely event of its paths frequent. On the plates one event cannot be had: a lamp in the narrow highlight of a plate
/// that is itself seen in another plate. Without MIS and with uniform directions it comes once in two million samples.
/// So the plates are compared three times: as they are, one bounce, every lever (what the plates were made for: light
/// samples alone against MIS); as they are, all bounces, every lever but those two; and every lever, all bounces, with
/// highlights and lamps wide enough for that.

#include "integrator/pixel_moments.hpp"
#include "pathscope/integrator/path_estimator.hpp"
#include "pathscope/scene/camera.hpp"
#include "pathscope/scene/load.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

const std::string k_plates = "scenes/mis_plates/scene.json";

Scene build(const OpenedScene& opened) { return *make_scene(opened.file, opened.parts, {.threads = 0}); }

/// grid x grid pixels spread over the picture of this size.
struct View {
    const Camera& camera;
    int width, height, grid;
};

std::vector<PixelMoments> pixels_of(const Scene& scene, const View& view, const TransportSettings& settings,
                                    int samples) {
    const CameraFrame camera = make_camera(view.camera, view.width, view.height);
    return picture(view.grid, samples, [&](int column, int row, std::uint32_t sample) {
        const int x = (2 * column + 1) * view.width / (2 * view.grid);
        const int y = (2 * row + 1) * view.height / (2 * view.grid);
        std::uint64_t rays = 0;
        // Independent samples: the test needs their variance, and low-discrepancy points hide it.
        const PixelSampler sampler(SamplerKind::independent, 21, x, y, sample);
        const Ray ray = camera_ray(camera, x, y, sampler.get_2d(k_pixel_dimension));
        return estimate_radiance<LightPart::direct>(scene, settings, ray, sampler, rays) +
               estimate_radiance<LightPart::indirect>(scene, settings, ray, sampler, rays);
    });
}

TransportSettings one_bounce(TransportSettings settings) {
    settings.max_bounces = 1;
    return settings;
}

/// Both settings, all bounces, in few and large pixels.
void check_settings_agree(const OpenedScene& opened, int samples) {
    const Scene scene = build(opened);
    const View view{opened.file.cameras.front().view, 4, 4, 4};
    const TransportSettings best = make_settings(Setting::best);
    const auto textbook = pixels_of(scene, view, make_settings(Setting::textbook), samples);
    CHECK(same_mean(pixels_of(scene, view, best, samples), textbook));
    // The test can fail: without indirect light it is another image.
    CHECK_FALSE(same_mean(pixels_of(scene, view, one_bounce(best), samples), textbook));
}

}  // namespace

TEST_CASE("textbook and best converge to the same image of the Cornell box") {
    check_settings_agree(*open_scene("scenes/cornell/scene.json", {}), k_sanitized ? 3000 : 60'000);
}

// Under a sanitizer there is no time for the samples that the plates need.
TEST_CASE("textbook and best converge to the same image of the plates with wide highlights" *
          doctest::skip(k_sanitized)) {
    OpenedScene opened = *open_scene(k_plates, {});
    for (Material& material : opened.parts.materials) material.roughness = std::max(material.roughness, 0.4f);
    for (LightSpec& light : opened.file.lights)
        if (auto* sphere = std::get_if<SphereLightSpec>(&light))
            sphere->radius = std::max(sphere->radius, 0.4f);
    check_settings_agree(opened, 60'000);
}

TEST_CASE("textbook and best converge to the same image of the plates as they are" *
          doctest::skip(k_sanitized)) {
    const OpenedScene opened = *open_scene(k_plates, {});
    const Scene scene = build(opened);
    const View view{opened.file.cameras.front().view, 640, 480, 6};
    const TransportSettings best = make_settings(Setting::best);

    SUBCASE("one bounce, all levers") {
        const auto textbook = pixels_of(scene, view, one_bounce(make_settings(Setting::textbook)), 300'000);
        CHECK(same_mean(pixels_of(scene, view, one_bounce(best), 100'000), textbook));
    }
    SUBCASE("all bounces, all levers but direction and MIS") {
        TransportSettings textbook = make_settings(Setting::textbook);
        textbook.hemisphere = best.hemisphere;
        textbook.mis = best.mis;
        const auto expected = pixels_of(scene, view, textbook, 200'000);
        CHECK(same_mean(pixels_of(scene, view, best, 100'000), expected));
        CHECK_FALSE(same_mean(pixels_of(scene, view, one_bounce(best), 100'000), expected));
    }
}
