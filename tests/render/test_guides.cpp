#include "pathscope/render/guides.hpp"

#include "render/render_scenes.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr Rgb k_paint{0.2f, 0.4f, 0.8f};

/// A wall at z = -3 from far left up to x = right_edge, its front towards the camera or away from it.
Scene half_wall(float right_edge, bool front) {
    SceneParts parts = empty_parts();
    const Vec3 along_x{20, 0, 0}, along_y{0, 20, 0};
    add_rectangle(parts, {right_edge - 20, -10, -3}, front ? along_x : along_y, front ? along_y : along_x,
                  add_material(parts, lambert(k_paint)));
    return small_scene(std::move(parts), {SkySpec{{1, 1, 1}}});
}

/// The distance to z = -3, by geometry, over the camera rays of the image itself.
float expected_depth(const RenderSettings& settings, int x, int y) {
    const CameraFrame camera = make_camera(wide_camera(), settings.width, settings.height);
    float sum = 0;
    for (std::uint32_t sample = 0; sample < k_guide_samples; ++sample) {
        const PixelSampler sampler(settings.transport.sampler, settings.seed, x, y, sample);
        sum += 3 / -camera_ray(camera, x, y, sampler.get_2d(k_pixel_dimension)).direction.z;
    }
    return sum / k_guide_samples;
}

}  // namespace

TEST_CASE("a wall: its colour, its normal towards the camera, its distance; zero beside it") {
    for (const bool front : {true, false}) {
        CAPTURE(front);
        const Scene scene = half_wall(0, front);
        const RenderSettings settings = small_settings(scene, 8, 4);
        const Guides guides = render_guides(scene, wide_camera(), settings, {0, 0, 8, 4}, 2);
        for (int y = 0; y < 4; ++y)
            for (int x = 0; x < 8; ++x) {
                const bool wall = x < 4;
                CHECK(length(guides.normal.at(x, y) - (wall ? Vec3{0, 0, 1} : Vec3{})) < 1e-6f);
                CHECK(length(guides.albedo.at(x, y) - (wall ? k_paint : Rgb{})) < 1e-6f);
                const float depth = wall ? expected_depth(settings, x, y) : 0;
                CHECK(std::abs(guides.depth.at(x, y) - depth) <= 1e-5f * depth);
            }
    }
}

TEST_CASE("on an edge the albedo is a share, the normal has length one and the depth is that of the wall") {
    const Scene scene = half_wall(-0.75f, true);  // In the middle of column 3.
    const RenderSettings settings = small_settings(scene, 8, 4);
    const Guides guides = render_guides(scene, wide_camera(), settings, {3, 0, 1, 4}, 1);
    for (int y = 0; y < 4; ++y) {
        const float share = guides.albedo.at(0, y).z / k_paint.z;
        CHECK(share > 0.2f);
        CHECK(share < 0.8f);
        CHECK(length(guides.normal.at(0, y)) == doctest::Approx(1));
        CHECK(guides.depth.at(0, y) >= 3);
        CHECK(guides.depth.at(0, y) < 6);
    }
}

TEST_CASE("the guides of a rectangle are a piece of those of the frame") {
    const Scene scene = small_room();
    const RenderSettings settings = small_settings(scene);
    const Guides whole = render_guides(scene, room_camera(), settings, {0, 0, 12, 8}, 3);
    const PixelRect rect{5, 2, 6, 5};
    const Guides part = render_guides(scene, room_camera(), settings, rect, 1);
    CHECK(part.albedo == crop(whole.albedo, rect));
    CHECK(part.normal == crop(whole.normal, rect));
    CHECK(part.depth == crop(whole.depth, rect));
    CHECK(!(part.depth == crop(whole.depth, {4, 2, 6, 5})));
}
