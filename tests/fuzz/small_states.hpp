#pragma once
/// A few render states and lists of scene files, for scripts that name them by a number.

#include <array>
#include <string_view>

#include "pathscope/core/check.hpp"
#include "pathscope/session/render_state.hpp"

namespace pathscope::fuzz {

/// What the files of the manifests hold.
inline constexpr std::array<std::string_view, 3> k_small_files{"", "v 0 0 0\n",
                                                               "newmtl grey\nKd 0.5 0.5 0.5\n"};

inline constexpr std::size_t k_small_manifests = 4;

/// No file; one of each content; the same content twice; one whose size is a lie.
inline Manifest small_manifest(std::size_t number) {
    Manifest manifest;
    if (number == 0) return manifest;
    for (std::size_t i = 0; i < k_small_files.size(); ++i)
        manifest.files.push_back(
            {"file" + std::string(1, char('0' + i)), k_small_files[i].size(), hash_text(k_small_files[i])});
    if (number == 2) manifest.files.push_back({"twin", k_small_files[1].size(), hash_text(k_small_files[1])});
    if (number == 3) manifest.files.push_back({"liar", 700'000, hash_text("none has these bytes")});
    manifest.missing = {"absent.png"};
    return manifest;
}

inline constexpr std::size_t k_small_states = 6;

inline RenderState make_small_state(std::size_t number) {
    constexpr std::array<std::string_view, 2> k_scenes{
        R"({"name": "one", "obj": "one.obj", "up_axis": "Y",
            "camera": {"position": [0, 0, 4], "look_at": [0, 0, 0], "up": [0, 1, 0], "vfov_deg": 40},
            "lights": [{"type": "sphere", "centre": [0, 0, 0], "radius": 1, "radiance": [1, 1, 1]}]})",
        R"({"name": "two", "obj": ["two.obj", "three.obj"], "up_axis": "Z", "exposure_ev": 1.5,
            "cameras": [{"name": "a", "position": [0, 2, 4], "look_at": [0, 0, 0], "vfov_deg": 60, "aspect": "3:2"}],
            "lights": [{"type": "sun", "to_sun": [0, 1, 0], "irradiance": [1, 2, 3]}, {"type": "sky", "radiance": [1, 1, 1]}],
            "materials": {"wall": {"kd": [0.5, 0.5, 0.5], "roughness": 0.25}}})"};
    const auto scene = parse_scene_file(k_scenes[number % 4 == 3 ? 1 : 0], "a small scene");
    CHECK(bool(scene), scene.error().message);
    RenderState state;
    state.scene = *scene;
    state.files = hash_text(pack_manifest(small_manifest(number % k_small_manifests)));
    state.camera = state.scene.cameras.front().view;
    state.settings.width = 12;
    state.settings.height = number == 4 ? 5 : 8;
    state.settings.spp = 6;
    state.settings.direct_spp = 2;
    state.settings.seed = std::uint32_t(number);
    state.options.smoothing = number != 5;
    if (number == 2) state.settings.wire = WireFormat::half;
    if (number == 3) state.settings.wire = WireFormat::shared;
    if (number == 5) state.settings.filter = FilterPlace::client;
    return state;
}

/// Other seeds, sizes, scenes and files; of 12 x 8 pixels.
inline const RenderState& small_state(std::size_t number) {
    static const std::array<RenderState, k_small_states> states{make_small_state(0), make_small_state(1),
                                                                make_small_state(2), make_small_state(3),
                                                                make_small_state(4), make_small_state(5)};
    return states.at(number);
}

}  // namespace pathscope::fuzz
