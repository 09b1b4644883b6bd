#include "pathscope/render/round_renderer.hpp"

#include <algorithm>
#include <limits>

#include "render/render_scenes.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr LightPart k_parts[] = {LightPart::direct, LightPart::indirect};

bool any_light(const std::vector<PixelSum>& sums) {
    return std::ranges::any_of(sums, [](const PixelSum& sum) { return sum.r > 0; });
}

}  // namespace

TEST_CASE("a round does not depend on the threads") {
    const Scene scene = small_room();
    const RenderSettings settings = small_settings(scene);
    for (const LightPart part : k_parts) {
        const Round round = whole_frame(settings, 0, 4);
        const RoundResult one = *render_round(scene, room_camera(), settings, part, round, 1);
        REQUIRE(any_light(one.sums));
        CHECK(one.samples == 12 * 8 * 4);
        CHECK(one.rays > one.samples);
        for (const int threads : {2, 7}) {
            const RoundResult many = *render_round(scene, room_camera(), settings, part, round, threads);
            CHECK(many.sums == one.sums);
            CHECK(many.rays == one.rays);
        }
    }
}

TEST_CASE("S9: rounds and blocks may be cut anywhere") {
    const Scene scene = small_room();
    const RenderSettings settings = small_settings(scene);
    const BlockGrid grid(settings.width, settings.height, 5);
    for (const LightPart part : k_parts) {
        const auto sums_of = [&](const Round& round) {
            return render_round(scene, room_camera(), settings, part, round, 2)->sums;
        };
        const std::vector<PixelSum> whole = sums_of(whole_frame(settings, 0, 8));
        CHECK(sums_of(whole_frame(settings, 8, 8)) != whole);  // Other samples, other noise.
        for (std::uint32_t block = 0; block < grid.count(); ++block) {
            const std::vector<PixelSum> early = sums_of(grid.round(block, 0, 3));
            const std::vector<PixelSum> late = sums_of(grid.round(block, 3, 5));
            const PixelRect rect = grid.rect(block);
            for (std::size_t i = 0; i < early.size(); ++i) {
                const std::size_t x = std::size_t(rect.x) + i % std::size_t(rect.width);
                const std::size_t y = std::size_t(rect.y) + i / std::size_t(rect.width);
                REQUIRE(early[i] + late[i] == whole[y * std::size_t(settings.width) + x]);
            }
        }
    }
}

TEST_CASE("a cancelled round yields nothing") {
    const Scene scene = two_panels();
    const RenderSettings settings = small_settings(scene);
    CancelFlag cancelled = false;
    const auto render = [&] {
        return render_round(scene, wide_camera(), settings, LightPart::direct, whole_frame(settings, 0, 1), 2,
                            &cancelled);
    };
    CHECK(render());
    cancelled = true;
    CHECK(!render());
}

TEST_CASE("samples that are no radiance are dropped, counted and listed, and nothing else is") {
    const float bad[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                         -1.0f};
    for (const float value : bad) {
        CAPTURE(value);
        Scene scene = two_panels();
        scene.materials[1].ke = {1, value, 1};  // The left panel, spoilt behind the back of make_scene.
        const RenderSettings settings = small_settings(scene, 8, 4);
        const Round round = whole_frame(settings, 2, 3);
        const RoundResult result = *render_round(scene, wide_camera(), settings, LightPart::direct, round, 2);

        const std::int64_t one = std::int64_t(1) << -settings.quantum.exponent;
        std::vector<DroppedSample> expected;
        for (std::uint32_t y = 0; y < 4; ++y)
            for (std::uint32_t x = 0; x < 8; ++x) {
                const bool left = x < 4;
                CHECK(result.sums[y * 8 + x] == (left ? PixelSum{} : PixelSum{3 * one, 3 * one, 3 * one}));
                for (std::uint32_t sample = 2; left && sample < 5; ++sample)
                    expected.push_back({x, y, sample});
            }
        CHECK(result.dropped == expected);
        CHECK(result.dropped_count == 4 * 4 * 3);
        CHECK(result.samples == 8 * 4 * 3);  // They count in the mean.
        CHECK(result.saturated_count == 0);
    }
}

TEST_CASE("the list of dropped samples is bounded, its count is not") {
    Scene scene = two_panels();
    for (Material& material : scene.materials)
        material.ke = Rgb{std::numeric_limits<float>::infinity(), 0, 0};
    const RenderSettings settings = small_settings(scene, 8, 4);
    const RoundResult result =
        *render_round(scene, wide_camera(), settings, LightPart::direct, whole_frame(settings, 0, 5), 2);
    CHECK(result.dropped_count == 8 * 4 * 5);
    REQUIRE(result.dropped.size() == k_max_dropped_listed);
    CHECK(result.dropped.back() == DroppedSample{4, 1, 3});  // Sample 63 = (1 * 8 + 4) * 5 + 3.
}

TEST_CASE("samples beyond the range of the sums are clamped and counted") {
    Scene scene = two_panels();
    scene.materials[2].ke = {1e30f, 1, 1};  // The right panel.
    RenderSettings settings = small_settings(scene, 8, 4);
    settings.quantum = {-20};
    const RoundResult result =
        *render_round(scene, wide_camera(), settings, LightPart::direct, whole_frame(settings, 0, 3), 2);
    CHECK(result.saturated_count == 4 * 4 * 3);
    CHECK(result.dropped_count == 0);
    CHECK(result.sums.front() == PixelSum{3 << 20, 3 << 20, 3 << 20});
    CHECK(result.sums.back() == PixelSum{3 * k_max_quanta, 3 << 20, 3 << 20});
}

TEST_CASE("both parts at once are the parts one by one: sums, dropped samples, counts") {
    const Scene scene = small_room();
    const RenderSettings settings = small_settings(scene);
    const Round round = whole_frame(settings, 3, 5);
    const RoundResult direct = *render_round(scene, room_camera(), settings, LightPart::direct, round, 1);
    const RoundResult indirect = *render_round(scene, room_camera(), settings, LightPart::indirect, round, 1);
    for (const int threads : {1, 2, 5}) {
        const PartsResult both = *render_both_parts(scene, room_camera(), settings, round, threads);
        CHECK(both.direct.sums == direct.sums);
        CHECK(both.indirect.sums == indirect.sums);
        CHECK(both.direct.samples == round.samples());
        CHECK(both.indirect.samples == round.samples());
        CHECK(both.direct.rays + both.indirect.rays < direct.rays + indirect.rays);
    }
    CHECK(direct.sums != indirect.sums);  // Or equal bits would say little.
    const CancelFlag cancelled(true);
    CHECK_FALSE(render_both_parts(scene, room_camera(), settings, round, 1, &cancelled));
}
