#include "pathscope/render/rendered_frame.hpp"

#include <cmath>

#include "pathscope/image/image_hash.hpp"
#include "render/render_scenes.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// Two blocks of 4 x 4 pixels side by side, each of one colour.
FrameSums two_blocks(float left, float right) {
    const BlockGrid grid(8, 4, 4);
    FrameSums frame(grid, Quantum{-20});
    bool saturated = false;
    for (const std::uint32_t block : {0u, 1u}) {
        const float value = block == 0 ? left : right;
        frame.add(grid.round(block, 0, 1),
                  std::vector(16, quantise({value, value, value}, Quantum{-20}, saturated)));
    }
    return frame;
}

/// A wall facing the camera, whose right half is `step` times as far away.
Guides wall_with_step(float step) {
    Guides guides{Image(8, 4, Vec3{0, 0, 1}), Image(8, 4, Rgb{0.5f, 0.5f, 0.5f}), Plane(8, 4, 1.0f)};
    for (int y = 0; y < 4; ++y)
        for (int x = 4; x < 8; ++x) guides.depth.at(x, y) = step;
    return guides;
}

Image combined(const Scene& scene, const Camera& camera, const RenderSettings& settings, int block_size,
               int threads) {
    const LocalRender render = render_locally(scene, camera, settings, block_size, threads);
    Guides guides;
    if (settings.filter == FilterPlace::client)
        guides = render_guides(scene, camera, settings, {0, 0, settings.width, settings.height}, threads);
    return compose_frame(render.direct, render.indirect, settings, guides, threads).combined;
}

}  // namespace

TEST_CASE("combined is direct + indirect") {
    RenderSettings settings;
    for (const FilterPlace place : {FilterPlace::off, FilterPlace::server}) {  // The server's is done by now.
        settings.filter = place;
        const RenderedFrame frame = compose_frame(two_blocks(0.25f, 0.5f), two_blocks(1, 3), settings, {}, 2);
        for (int x = 0; x < 8; ++x) {
            const bool left = x < 4;
            CHECK(frame.direct.at(x, 2).y == (left ? 0.25f : 0.5f));
            CHECK(frame.indirect.at(x, 2).y == (left ? 1.0f : 3.0f));
            CHECK(frame.combined.at(x, 2).y == (left ? 1.25f : 3.5f));
        }
        CHECK(frame.indirect == frame.unfiltered);
    }
}

TEST_CASE("the client's filter blurs indirect light alone, and stops at edges of the guides") {
    RenderSettings settings;
    settings.filter = FilterPlace::client;
    SUBCASE("joint") {}
    SUBCASE("atrous") { settings.filter_kind = FilterKind::atrous; }
    const FrameSums direct = two_blocks(0, 1), indirect = two_blocks(0, 1);

    const RenderedFrame flat = compose_frame(direct, indirect, settings, wall_with_step(1), 2);
    CHECK(flat.indirect.at(3, 2).x > 0.2f);
    CHECK(flat.indirect.at(4, 2).x < 0.8f);
    CHECK(flat.direct.at(3, 2).x == 0);
    CHECK(flat.unfiltered.at(3, 2).x == 0);
    CHECK(flat.combined.at(4, 2).x == 1 + flat.indirect.at(4, 2).x);

    const RenderedFrame edge = compose_frame(direct, indirect, settings, wall_with_step(2), 2);
    CHECK(edge.indirect.at(3, 2).x < 1e-6f);
    CHECK(edge.indirect.at(4, 2).x > 1 - 1e-6f);
}

TEST_CASE("S10: a local image does not depend on blocks or threads, unless the filter runs on tiles") {
    const Scene scene = small_room();
    RenderSettings settings = small_settings(scene);
    const Digest expected = image_hash(combined(scene, room_camera(), settings, 64, 1));
    for (const int block_size : {1, 5, 8})
        for (const int threads : {1, 3})
            CHECK(image_hash(combined(scene, room_camera(), settings, block_size, threads)) == expected);

    settings.filter = FilterPlace::client;  // Of the whole picture: no seams.
    const Digest filtered = image_hash(combined(scene, room_camera(), settings, 64, 2));
    CHECK(filtered != expected);
    CHECK(image_hash(combined(scene, room_camera(), settings, 5, 2)) == filtered);

    settings.filter = FilterPlace::server;
    const Digest whole = image_hash(combined(scene, room_camera(), settings, 64, 2));
    CHECK(whole != expected);
    CHECK(image_hash(combined(scene, room_camera(), settings, 5, 2)) != whole);  // Seams.

    settings.seed = 2;
    settings.filter = FilterPlace::off;
    CHECK(image_hash(combined(scene, room_camera(), settings, 5, 2)) != expected);
}

TEST_CASE("a furnace has le / (1 - rho) everywhere, and its samples are counted") {
    const Scene scene = furnace(1, 0.5f);
    RenderSettings settings = small_settings(scene, 16, 16);
    settings.spp = 16;
    settings.direct_spp = 8;
    const LocalRender render = render_locally(scene, room_camera(), settings, 8, 2);
    CHECK(render.samples == 16 * 16 * (16 + 8));
    CHECK(render.rays > render.samples);
    CHECK(render.dropped == 0);
    CHECK(render.direct.samples_of_block(3) == 8);
    CHECK(render.indirect.samples_of_block(3) == 16);

    double sum = 0, squares = 0;
    const Image image = compose_frame(render.direct, render.indirect, settings, {}, 2).combined;
    for (const Rgb pixel : image.pixels) {
        sum += double(pixel.x);
        squares += double(pixel.x) * double(pixel.x);
    }
    const double count = double(image.pixels.size()), mean = sum / count;
    const double error = std::sqrt((squares / count - mean * mean) / count);
    CHECK(error < 0.02);
    CHECK(std::abs(mean - 2) < 4 * error + 1e-5);  // 4 sigma: a right program fails for 1 seed in 16,000.
}

TEST_CASE("without samples of one part its picture is black") {
    const Scene scene = furnace(1, 0.5f);
    RenderSettings settings = small_settings(scene);
    settings.spp = 0;
    const LocalRender render = render_locally(scene, room_camera(), settings, 8, 2);
    const RenderedFrame frame = compose_frame(render.direct, render.indirect, settings, {}, 2);
    CHECK(frame.indirect == Image(12, 8));
    CHECK(frame.combined == frame.direct);
    CHECK(!(frame.direct == Image(12, 8)));
}
