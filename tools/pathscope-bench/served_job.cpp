#include "served_job.hpp"

#include <algorithm>

namespace pathscope::bench {

Result<ClientJob> scene_job(const SceneChoice& choice) {
    Result<OpenedScene> opened = open_scene(choice.path, {});
    if (!opened) return opened.error();
    Result<Scene> scene = make_scene(opened->file, std::move(opened->parts), {.threads = 1});
    if (!scene) return scene.error();
    RenderState state;
    state.scene = opened->file;
    state.camera = opened->file.cameras.front().view;
    state.settings.quantum = quantum_for(scene->typical_radiance, scene->brightest_radiance);
    return ClientJob{state, std::make_shared<const Scene>(std::move(*scene)), SceneDepot(*opened->files)};
}

ClientJob sized(ClientJob job, int width, int height, double samples) {
    RenderSettings& settings = job.state.settings;
    settings.width = width;
    settings.height = height;
    settings.direct_spp = 0;
    const double spp = samples / (double(width) * double(height));
    settings.spp = std::uint32_t(std::clamp(spp + 0.5, 1.0, double(k_max_samples_per_pixel)));
    return job;
}

}  // namespace pathscope::bench
