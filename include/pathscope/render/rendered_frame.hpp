#pragma once
/// The finished frame: direct and indirect light put together.
///
///   combined = direct / n_direct + filter(indirect / n_indirect)
///
/// Thread safety: values.   Test: tests/render/test_rendered_frame.cpp

#include <cstdint>
#include <string>
#include <vector>

#include "pathscope/image/image.hpp"
#include "pathscope/render/frame_sums.hpp"
#include "pathscope/render/guides.hpp"

namespace pathscope {

/// The pictures that a frame is made of, each by the name it has on the command line and in files.
struct RenderedFrame {
    Image combined;
    Image direct;
    Image indirect;    ///< As it goes into `combined`: after the filter, if that runs at the client.
    Image unfiltered;  ///< Indirect light before the filter.
};

/// `guides` is used, and must not be empty, when the filter runs at the client.
[[nodiscard]] RenderedFrame compose_frame(const FrameSums& direct, const FrameSums& indirect,
                                          const RenderSettings& settings, const Guides& guides, int threads);

/// One machine, one loop: all rounds of a frame here, in order. What every distributed image must equal, bit for bit.
struct LocalRender {
    FrameSums direct, indirect;
    std::uint64_t rays = 0, samples = 0, dropped = 0;
};
[[nodiscard]] LocalRender render_locally(const Scene& scene, const Camera& camera,
                                         const RenderSettings& settings, int block_size, int threads);

}  // namespace pathscope
