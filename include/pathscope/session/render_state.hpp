#pragma once
/// The render state: everything that a pixel depends on, in one value.
///
///     pixel = f(state, pixel, samples),   state_hash(a) == state_hash(b)  =>  the same image
///
/// Why: a server that has it needs nothing else, and two machines can compare 32 bytes to know that they would render
/// the same picture. It travels as a MessagePack map whose keys are those of docs/protocol.md, section "Render state";
/// every value is absolute, so an INPUT that was lost is mended by any later snapshot.
/// Errors: what comes from the wire is checked as strictly as a command line; the sentence names the key.
/// Thread safety: values.   Test: tests/session/test_render_state.cpp

#include <string>
#include <string_view>

#include "pathscope/core/hash.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/render/render_settings.hpp"
#include "pathscope/scene/camera.hpp"
#include "pathscope/scene/load.hpp"
#include "pathscope/scene/scene_file.hpp"
#include "pathscope/wire/message_pack.hpp"

namespace pathscope {

struct RenderState {
    SceneFile scene;
    Digest files{};  ///< Hash of the manifest that names the scene's files by content: packed_manifest().
    SceneOptions options;
    Camera camera;
    RenderSettings settings;

    friend bool operator==(const RenderState&, const RenderState&) = default;
};

[[nodiscard]] PackMap encode_state(const RenderState& state);
[[nodiscard]] Result<RenderState> decode_state(const PackMap& map);

/// Hash of the packed map; equal states have equal maps.
[[nodiscard]] Digest state_hash(const RenderState& state);

/// The entries of `after` that differ from `before`.
[[nodiscard]] PackMap state_changes(const RenderState& before, const RenderState& after);

/// `state` with the entries of `changes` in place of its own. Unknown keys are an error: a server that does not know
/// a lever would render another image.
[[nodiscard]] Result<RenderState> apply_changes(const RenderState& state, const PackMap& changes);

/// Whether both states show the same geometry, materials and lights, so that a loaded scene serves both.
[[nodiscard]] bool same_scene(const RenderState& a, const RenderState& b);

/// A manifest as it travels, and back. The names are keys only; sizes are bounded by k_max_scene_bytes in all.
[[nodiscard]] std::string pack_manifest(const Manifest& manifest);
[[nodiscard]] Result<Manifest> unpack_manifest(std::string_view bytes);

inline constexpr std::uint64_t k_max_scene_bytes = std::uint64_t{16} << 30;

}  // namespace pathscope
