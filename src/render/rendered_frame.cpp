#include "pathscope/render/rendered_frame.hpp"

#include "pathscope/core/parallel_for.hpp"
#include "pathscope/render/round_renderer.hpp"
#include "pathscope/render/tile_filter.hpp"

namespace pathscope {
namespace {

void render_part(const Scene& scene, const Camera& camera, const RenderSettings& settings, LightPart part,
                 int threads, FrameSums& sums, LocalRender& total) {
    const std::uint32_t spp = part == LightPart::direct ? settings.direct_spp : settings.spp;
    if (spp == 0) return;
    for (std::uint32_t block = 0; block < sums.grid().count(); ++block) {
        const Round round = sums.grid().round(block, 0, spp);
        RoundResult result = *render_round(scene, camera, settings, part, round, threads);
        if (part == LightPart::indirect && settings.filter == FilterPlace::server)
            result.sums = filter_tile(scene, camera, settings, round, result.sums, threads);
        sums.add(round, result.sums);
        total.rays += result.rays;
        total.samples += result.samples;
        total.dropped += result.dropped_count;
    }
}

}  // namespace

RenderedFrame compose_frame(const FrameSums& direct, const FrameSums& indirect,
                            const RenderSettings& settings, const Guides& guides, int threads) {
    RenderedFrame frame;
    frame.direct = direct.mean();
    frame.unfiltered = indirect.mean();
    frame.indirect = settings.filter == FilterPlace::client
                         ? joint_bilateral(frame.unfiltered, guides, settings.bilateral, threads)
                         : frame.unfiltered;
    frame.combined = frame.direct;
    for (std::size_t i = 0; i < frame.combined.pixels.size(); ++i)
        frame.combined.pixels[i] += frame.indirect.pixels[i];
    return frame;
}

LocalRender render_locally(const Scene& scene, const Camera& camera, const RenderSettings& settings,
                           int block_size, int threads) {
    const BlockGrid grid(settings.width, settings.height, block_size);
    LocalRender total{FrameSums(grid, settings.quantum), FrameSums(grid, settings.quantum)};
    render_part(scene, camera, settings, LightPart::direct, threads, total.direct, total);
    render_part(scene, camera, settings, LightPart::indirect, threads, total.indirect, total);
    return total;
}

}  // namespace pathscope
