#include "pathscope/render/rendered_frame.hpp"

#include "pathscope/core/parallel_for.hpp"
#include "pathscope/render/indirect_filter.hpp"
#include "pathscope/render/round_renderer.hpp"
#include "pathscope/render/tile_filter.hpp"

namespace pathscope {
namespace {

void add(FrameSums& sums, const Round& round, const RoundResult& result, LocalRender& total) {
    sums.add(round, result.sums);
    total.rays += result.rays;
    total.samples += result.samples;
    total.dropped += result.dropped_count;
}

}  // namespace

RenderedFrame compose_frame(const FrameSums& direct, const FrameSums& indirect,
                            const RenderSettings& settings, const Guides& guides, int threads) {
    RenderedFrame frame;
    frame.direct = direct.mean();
    frame.unfiltered = indirect.mean();
    frame.indirect = settings.filter == FilterPlace::client
                         ? filter_indirect(frame.unfiltered, guides, settings, threads)
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
    const auto finish_indirect = [&](const Round& round, RoundResult& result) {
        if (settings.filter == FilterPlace::server)
            result.sums = filter_tile(scene, camera, settings, round, result.sums, threads);
        add(total.indirect, round, result, total);
    };
    for (std::uint32_t block = 0; block < grid.count(); ++block) {
        const Round direct = grid.round(block, 0, settings.direct_spp),
                    indirect = grid.round(block, 0, settings.spp);
        if (settings.direct_spp == settings.spp && settings.spp > 0) {
            PartsResult both = *render_both_parts(scene, camera, settings, indirect, threads);
            add(total.direct, direct, both.direct, total);
            finish_indirect(indirect, both.indirect);
            continue;
        }
        if (settings.direct_spp > 0)
            add(total.direct, direct,
                *render_round(scene, camera, settings, LightPart::direct, direct, threads), total);
        if (settings.spp > 0) {
            RoundResult result =
                *render_round(scene, camera, settings, LightPart::indirect, indirect, threads);
            finish_indirect(indirect, result);
        }
    }
    return total;
}

}  // namespace pathscope
