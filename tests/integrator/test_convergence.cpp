/// The two settings agree on whole scenes: per pixel, by a z-test with Sidak's correction.

#include "integrator/pixel_moments.hpp"
#include "pathscope/integrator/path_estimator.hpp"
#include "pathscope/scene/camera.hpp"
#include "pathscope/scene/load.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

std::vector<PixelMoments> small_picture(const Scene& scene, const Camera& view,
                                        const TransportSettings& settings, int size, int samples) {
    const CameraFrame camera = make_camera(view, size, size);
    return picture(size, samples, [&](int x, int y, std::uint32_t sample) {
        std::uint64_t rays = 0;
        // Independent samples: the test needs their variance, and low-discrepancy points hide it.
        const PixelSampler sampler(SamplerKind::independent, 21, x, y, sample);
        const Ray ray = camera_ray(camera, x, y, sampler.get_2d(k_pixel_dimension));
        return estimate_radiance<LightPart::direct>(scene, settings, ray, sampler, rays) +
               estimate_radiance<LightPart::indirect>(scene, settings, ray, sampler, rays);
    });
}

}  // namespace

TEST_CASE("textbook and best converge to the same image, on the Cornell box and on the plates") {
    for (const std::string& path :
         {std::string("scenes/cornell/scene.json"), std::string("scenes/mis_plates/scene.json")}) {
        CAPTURE(path);
        // Under a sanitizer there is no time for the samples that the plates need.
        if (k_sanitized && path != "scenes/cornell/scene.json") continue;
        // Plates and lamps as smooth and as small as the textbook can deal with: where a lamp of 5 cm shows in a nearly
        // perfect mirror, it meets the highlight once in 100,000 samples, and no mean of ours is normally distributed.
        OpenedScene opened = *open_scene(path, {});
        for (Material& material : opened.parts.materials)
            material.roughness = std::max(material.roughness, 0.4f);
        for (LightSpec& light : opened.file.lights)
            if (auto* sphere = std::get_if<SphereLightSpec>(&light))
                sphere->radius = std::max(sphere->radius, 0.4f);
        const Scene scene = *make_scene(opened.file, opened.parts, {.threads = 0});
        const Camera view = opened.file.cameras.front().view;
        const int size = 4, samples = k_sanitized ? 3000 : 60'000;
        const auto best = small_picture(scene, view, make_settings(Setting::best), size, samples);
        const auto textbook = small_picture(scene, view, make_settings(Setting::textbook), size, samples);
        CHECK(same_mean(best, textbook));

        TransportSettings wrong = make_settings(Setting::best);
        wrong.max_bounces = 1;  // The test can fail: without indirect light it is another image.
        CHECK_FALSE(same_mean(small_picture(scene, view, wrong, size, samples), textbook));
    }
}
