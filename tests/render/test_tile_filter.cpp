#include "pathscope/render/tile_filter.hpp"

#include <cmath>
#include <cstdlib>

#include "render/render_scenes.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// Sum of squared steps between neighbours in a row: how noisy the tile is.
double roughness(const std::vector<PixelSum>& sums, int width) {
    double sum = 0;
    for (std::size_t i = 1; i < sums.size(); ++i)
        if (i % std::size_t(width) != 0) sum += std::pow(double(sums[i].r - sums[i - 1].r), 2);
    return sum;
}

}  // namespace

TEST_CASE("radius 0 leaves a tile as it is, up to the rounding of its mean") {
    const Scene scene = small_room();
    RenderSettings settings = small_settings(scene);
    settings.bilateral.radius = 0;
    const Round round{0, {2, 1, 8, 6}, 0, 5};
    const RoundResult noisy = *render_round(scene, room_camera(), settings, LightPart::indirect, round, 2);
    const std::vector<PixelSum> filtered = filter_tile(scene, room_camera(), settings, round, noisy.sums, 2);
    REQUIRE(filtered.size() == noisy.sums.size());
    for (std::size_t i = 0; i < filtered.size(); ++i) {
        const std::int64_t before = noisy.sums[i].g, after = filtered[i].g;
        CHECK(std::abs(after - before) <=
              round.count + before / (1 << 23));  // A quantum each, and a float's last bit.
        CHECK(after % round.count == 0);
    }
}

TEST_CASE("a constant tile stays, for any radius, to a float's last bits") {
    const Scene scene = furnace(1, 0.5f);
    RenderSettings settings = small_settings(scene);
    settings.quantum = {-20};
    const Round round{0, {0, 0, 12, 8}, 0, 3};
    const PixelSum grey{3 * 700'001, 3 * 500'000, 3};
    for (const int radius : {1, 7}) {
        settings.bilateral.radius = radius;
        const std::vector<PixelSum> sums(12 * 8, grey);
        for (const PixelSum& sum : filter_tile(scene, room_camera(), settings, round, sums, 2)) {
            CHECK(std::abs(sum.r - grey.r) <= 3);
            CHECK(std::abs(sum.g - grey.g) <= 3);
            CHECK(sum.b == grey.b);
        }
    }
}

TEST_CASE("a tile is filtered by the kind that is asked for, and a-trous of no levels leaves it as it is") {
    const Scene scene = small_room();
    RenderSettings settings = small_settings(scene);
    const Round round{0, {0, 0, 12, 8}, 0, 2};
    const RoundResult noisy = *render_round(scene, room_camera(), settings, LightPart::indirect, round, 2);
    const auto filter = [&] { return filter_tile(scene, room_camera(), settings, round, noisy.sums, 2); };
    const std::vector<PixelSum> joint = filter();
    settings.filter_kind = FilterKind::atrous;
    const std::vector<PixelSum> wavelet = filter();
    CHECK(wavelet != joint);
    CHECK(roughness(wavelet, 12) < roughness(noisy.sums, 12));
    settings.atrous.levels = 0;
    const std::vector<PixelSum> none = filter();
    settings.filter_kind = FilterKind::joint;
    settings.bilateral.radius = 0;
    CHECK(filter() == none);
}

TEST_CASE("the filter smooths noise, the same for any threads") {
    const Scene scene = two_panels();  // Flat: guides differ by the depth alone.
    RenderSettings settings = small_settings(scene);
    settings.quantum = {-20};
    const Round round{0, {0, 0, 12, 8}, 0, 2};
    std::vector<PixelSum> noisy;
    for (int i = 0; i < 12 * 8; ++i) noisy.push_back({i % 2 ? 2 << 20 : 0, 0, 0});
    const auto filter = [&](int threads) {
        return filter_tile(scene, wide_camera(), settings, round, noisy, threads);
    };
    const std::vector<PixelSum> smooth = filter(1);
    CHECK(roughness(smooth, 12) < 0.05 * roughness(noisy, 12));
    CHECK(filter(5) == smooth);
}
