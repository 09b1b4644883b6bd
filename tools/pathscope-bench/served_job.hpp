#pragma once
/// What a client in this process gives to servers in others.

#include "pathscope/core/result.hpp"
#include "pathscope/session/client_session.hpp"
#include "scene_list.hpp"

namespace pathscope::bench {

/// A scene, seen by its first camera.
[[nodiscard]] Result<ClientJob> scene_job(const SceneChoice& choice);

/// Indirect light alone, of so many samples per pixel that it comes close to `samples` in all.
[[nodiscard]] ClientJob sized(ClientJob job, int width, int height, double samples);

}  // namespace pathscope::bench
