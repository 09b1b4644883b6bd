#pragma once
/// Small frames for tests of the renderer.

#include "integrator/estimator_scenes.hpp"
#include "pathscope/render/round_renderer.hpp"

namespace pathscope::testing {

inline RenderSettings small_settings(const Scene& scene, int width = 12, int height = 8) {
    RenderSettings settings;
    settings.width = width;
    settings.height = height;
    settings.spp = 4;
    settings.direct_spp = 4;
    settings.quantum = quantum_for(scene.typical_radiance, scene.brightest_radiance);
    return settings;
}

inline Camera room_camera() { return {{0, 0, 0.95f}, {0, -0.1f, 0}, {0, 1, 0}, 80}; }

/// Looks along -z; at distance d, a picture of 8 x 4 pixels covers x in [-2d, 2d] and y in [-d, d].
inline Camera wide_camera() { return {{0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 90}; }

/// Two black panels at z = -3, left and right of x = 0, that emit 1 each. Materials 1 and 2.
inline Scene two_panels() {
    SceneParts parts = empty_parts();
    for (const float x : {-10.0f, 0.0f})
        add_rectangle(parts, {x, -10, -3}, {10, 0, 0}, {0, 20, 0},
                      add_material(parts, lambert({}, {1, 1, 1})));
    return small_scene(std::move(parts), {EmissiveMtlSpec{}});
}

/// The whole frame as one round.
inline Round whole_frame(const RenderSettings& settings, std::uint32_t first, std::uint32_t count) {
    return {0, {0, 0, settings.width, settings.height}, first, count};
}

}  // namespace pathscope::testing
