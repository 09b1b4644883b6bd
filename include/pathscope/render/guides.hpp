#pragma once
/// Guides: what the camera sees first, without noise of light: albedo, normal, depth.
///
/// Each pixel is the mean over the first k_guide_samples camera rays of the image itself (same seed, same numbers), so
/// guides are anti-aliased as the image is and a server finds the same as the client.
/// Units: albedo 0..1; normal of length one in world space, towards the camera, zero where nothing is hit; depth is the
/// distance from the camera in scene units, 0 where nothing is hit.
/// Thread safety: pure.   Test: tests/render/test_guides.cpp

#include "pathscope/filter/joint_bilateral.hpp"
#include "pathscope/image/block.hpp"
#include "pathscope/render/render_settings.hpp"
#include "pathscope/scene/camera.hpp"
#include "pathscope/scene/scene.hpp"

namespace pathscope {

inline constexpr std::uint32_t k_guide_samples = 4;

/// The guides of the pixels of `rect`, as pictures of its size. Requires: rect lies in the frame.
[[nodiscard]] Guides render_guides(const Scene& scene, const Camera& camera, const RenderSettings& settings,
                                   PixelRect rect, int threads);

}  // namespace pathscope
