#pragma once
/// The golden round: a small picture of everything, whose hash tells whether two programs compute the same floats.
///
///     golden_hash() on A == golden_hash() on B    <=   A and B render the same bits
///
/// Why: an image is the same bits whoever renders it only while all of them round alike. An instruction set with other
/// rules, a compiler that fuses or reorders, a library with another root: each shows in the last bit of some path. So a
/// server says this hash when it joins, and its client compares (session/admission.hpp).
/// It proves difference, never equality: a scene may do what the golden one does not. Hence it holds a little of all that
/// there is: triangles with and without normals, spheres, every kind of material, textures, cut-outs, every kind of
/// light, both kinds of sampler, every lever of light transport, direct and indirect light, both filters. Its sums are
/// finer than those of images, so that less is rounded away.
/// Cost: some thousand paths on one thread, a few milliseconds, once per process.
/// Thread safety: yes.   Test: tests/render/test_golden_round.cpp

#include <array>

#include "pathscope/core/hash.hpp"
#include "pathscope/render/round_renderer.hpp"

namespace pathscope {

/// The same in every call: rendered by the first.
[[nodiscard]] const Digest& golden_hash();

/// What it is a hash of.
struct GoldenScene {
    Scene scene;
    Camera camera;
    std::array<RenderSettings, 4> settings;  ///< One after the other; the last two are filtered as well.
    Round round;                             ///< Of each.
};
[[nodiscard]] GoldenScene make_golden_scene();
[[nodiscard]] Digest render_golden(const GoldenScene& golden);

}  // namespace pathscope
