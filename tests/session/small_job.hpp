#pragma once
/// Our Cornell box in a few pixels, for sessions over real sockets; what its image must be; and the patience to wait for it.

#include <array>
#include <functional>
#include <memory>
#include <string>

#include "pathscope/image/image_hash.hpp"
#include "pathscope/render/rendered_frame.hpp"
#include "pathscope/session/client_session.hpp"

namespace pathscope::testing {

inline constexpr TimeNs k_patience = 120 * k_second_ns;  ///< A test that waits longer has failed.

struct SmallJob {
    OpenedScene opened;
    std::shared_ptr<const Scene> scene;
    RenderState state;

    explicit SmallJob(std::uint32_t spp = 8) : opened(*open_scene("scenes/cornell/scene.json", {})) {
        scene = std::make_shared<const Scene>(*make_scene(opened.file, opened.parts, {.threads = 1}));
        state.scene = opened.file;
        state.camera = opened.file.cameras.front().view;
        state.settings.width = 70;
        state.settings.height = 40;
        state.settings.spp = spp;
        state.settings.direct_spp = 2;
        state.settings.seed = 7;
        state.settings.quantum = quantum_for(scene->typical_radiance, scene->brightest_radiance);
    }
    [[nodiscard]] ClientJob job() const { return {state, scene, SceneDepot(*opened.files)}; }

    /// What every distributed image must equal.
    [[nodiscard]] Digest hash_of_one_machine(const RenderState& wanted) const {
        const LocalRender local = render_locally(*scene, wanted.camera, wanted.settings, 64, 1);
        return image_hash(compose_frame(local.direct, local.indirect, wanted.settings, {}, 1).combined);
    }
    [[nodiscard]] Digest hash_of_one_machine() const { return hash_of_one_machine(state); }
};

[[nodiscard]] inline Digest hash_of(const ClientSession& client) {
    const FrameWork& work = client.work();
    return image_hash(compose_frame(work.direct(), work.indirect(), client.state().settings, {}, 1).combined);
}

[[nodiscard]] inline std::array<int, 3> ports_of(const std::array<std::string, 3>& endpoints) {
    std::array<int, 3> ports;
    for (std::size_t i = 0; i < ports.size(); ++i)
        ports[i] = std::stoi(endpoints[i].substr(endpoints[i].rfind(':') + 1));
    return ports;
}

/// Steps the client until `done`; false when patience ends.
[[nodiscard]] inline bool step_until(ClientSession& client, const std::function<bool()>& done) {
    for (const TimeNs limit = monotonic_now() + k_patience; !done(); client.step(50 * k_millisecond_ns))
        if (monotonic_now() > limit) return false;
    return true;
}

[[nodiscard]] inline bool finish(ClientSession& client) {
    return step_until(client, [&] { return client.complete(); });
}

}  // namespace pathscope::testing
