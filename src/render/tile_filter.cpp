#include "pathscope/render/tile_filter.hpp"

#include "pathscope/render/indirect_filter.hpp"

namespace pathscope {

std::vector<PixelSum> filter_tile(const Scene& scene, const Camera& camera, const RenderSettings& settings,
                                  const Round& round, const std::vector<PixelSum>& sums, int threads) {
    CHECK(sums.size() == std::size_t(round.rect.area()), sums.size(), round.rect);
    Image noisy(round.rect.width, round.rect.height);
    for (std::size_t i = 0; i < sums.size(); ++i)
        noisy.pixels[i] = mean(sums[i], round.count, settings.quantum);

    const Guides guides = render_guides(scene, camera, settings, round.rect, threads);
    const Image filtered = filter_indirect(noisy, guides, settings, threads);

    std::vector<PixelSum> result(sums.size());
    bool saturated = false;  // Clamped only if demodulation by a dark albedo lifts a mean beyond the range.
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const PixelSum one = quantise(filtered.pixels[i], settings.quantum, saturated);
        const std::int64_t count = round.count;
        result[i] = {one.r * count, one.g * count, one.b * count};
    }
    return result;
}

}  // namespace pathscope
