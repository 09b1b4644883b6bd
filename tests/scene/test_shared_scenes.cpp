#include <algorithm>
#include <filesystem>
#include <vector>

#include "pathscope/math/random.hpp"
#include "pathscope/scene/light_sampling.hpp"
#include "pathscope/scene/surface.hpp"
#include "small_scenes.hpp"

#include "log_capture.hpp"
#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

std::vector<std::filesystem::path> shared_scene_files() {
    std::vector<std::filesystem::path> files;
    for (const auto& folder : std::filesystem::directory_iterator(shared_folder() / "scenes"))
        if (std::filesystem::exists(folder.path() / "scene.json"))
            files.push_back(folder.path() / "scene.json");
    std::sort(files.begin(), files.end());
    return files;
}

/// Asks the scene all that a renderer asks, at the first hits of 24 x 18 camera rays.
struct Survey {
    int hits = 0, lit = 0;
    bool sound = true;

    Survey(const Scene& scene, const Camera& view) {
        const CameraFrame camera = make_camera(view, 24, 18);
        HashRng rng(1);
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x) look(scene, camera_ray(camera, x, y, {0.5f, 0.5f}), rng);
    }

    void look(const Scene& scene, const Ray& ray, HashRng& rng) {
        const auto hit = intersect(scene, ray);
        if (!hit) return;
        ++hits;
        const ShadedPoint shaded = shade_point(scene, *hit, -ray.direction);
        sound = sound && is_finite(shaded.frame.normal) &&
                is_finite(surface_albedo(scene, *hit, -ray.direction)) &&
                is_consistent(shaded, -ray.direction) &&
                is_finite(emitted_radiance(scene, *hit, -ray.direction));
        bool reached = false;
        for (int i = 0; i < 8; ++i) {
            const float u_pick = rng.next_float(), u = rng.next_float(), v = rng.next_float();
            const auto light = sample_light(scene, LightSampling::power,
                                            {hit->point.position, shaded.frame.normal}, u_pick, {u, v});
            if (!light) continue;
            sound = sound && is_finite(light->radiance) && std::isfinite(light->pdf_solid_angle);
            reached = reached || !occluded(scene, shadow_ray(hit->point, *light));
        }
        lit += reached;
    }
};

}  // namespace

TEST_CASE("every shared scene can be rendered: rays meet it, light reaches it, all numbers are finite") {
    if (shared_folder().empty()) {
        MESSAGE("skipped: no ../shared");
        return;
    }
    const LogCapture log;
    const auto files = shared_scene_files();
    CHECK(files.size() >= 8);
    for (const auto& file : files) {
        CAPTURE(file.string());
        auto opened = open_scene(file, {});
        REQUIRE_MESSAGE(opened, opened.error().message);
        const Camera view = opened->file.cameras.front().view;
        const auto scene = make_scene(opened->file, std::move(opened->parts));
        REQUIRE_MESSAGE(scene, scene.error().message);

        CHECK_FALSE(scene->lights.empty());
        CHECK(scene->typical_radiance > 0);
        CHECK(scene->brightest_radiance >= scene->typical_radiance);
        const Survey survey(*scene, view);
        CHECK(survey.sound);
        CHECK(survey.hits > 24 * 18 / 3);
        // Direct light is everywhere but in veach_ajar, where the lamp is behind the door.
        if (opened->file.name != "veach_ajar") CHECK(survey.lit > survey.hits / 10);
    }
}
