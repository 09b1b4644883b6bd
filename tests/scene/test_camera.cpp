#include <limits>

#include "pathscope/math/random.hpp"
#include "pathscope/scene/camera.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {
float distance(Vec3 a, Vec3 b) { return length(a - b); }
}  // namespace

TEST_CASE("the centre of the image looks at look_at, also with an even number of pixels") {
    const Camera view{{1, 2, 3}, {-2, 4, 1}, {0, 1, 0}, 50};
    const CameraFrame camera = make_camera(view, 640, 360);
    const Ray ray = camera_ray(camera, 320, 180, {0, 0});
    CHECK(ray.origin == view.position);
    CHECK(distance(ray.direction, normalize(view.look_at - view.position)) < 1e-6f);
}

TEST_CASE("corners: a square camera of 90 degrees looks along (+-1, +-1, -1), top row first, right is +x") {
    const CameraFrame camera = make_camera({{0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 90}, 4, 4);
    CHECK(distance(camera_ray(camera, 0, 0, {0, 0}).direction, normalize(Vec3{-1, 1, -1})) < 1e-6f);
    CHECK(distance(camera_ray(camera, 4, 0, {0, 0}).direction, normalize(Vec3{1, 1, -1})) < 1e-6f);
    CHECK(distance(camera_ray(camera, 0, 4, {0, 0}).direction, normalize(Vec3{-1, -1, -1})) < 1e-6f);
    CHECK(distance(camera_ray(camera, 3, 3, {0.5f, 0.5f}).direction, normalize(Vec3{0.75f, -0.75f, -1})) <
          1e-6f);
}

TEST_CASE("vfov is the vertical angle whatever the aspect, and pixels are square") {
    for (const int width : {100, 200, 37}) {
        const CameraFrame camera = make_camera({{0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 60}, width, 100);
        const Vec3 top = normalize(camera.corner + camera.step_x * (0.5f * float(width)));
        const Vec3 bottom = normalize(top / -top.z + camera.step_y * 100);
        CHECK(dot(top, bottom) == doctest::Approx(0.5));  // cos 60 degrees
        CHECK(length(camera.step_x) == doctest::Approx(length(camera.step_y)));
    }
}

TEST_CASE("an up that is not orthogonal to the view only rolls the image") {
    const CameraFrame upright = make_camera({{0, 0, 0}, {0, -1, -1}, {0, 1, 0}, 40}, 8, 8);
    CHECK(upright.step_x.y == 0);
    CHECK(upright.step_y.y < 0);
    CHECK(std::abs(dot(upright.step_x, upright.step_y)) < 1e-9f);
    CHECK(length(upright.forward) == doctest::Approx(1));
}

TEST_CASE("projecting a point of a camera ray gives its pixel back") {
    const CameraFrame camera = make_camera({{1, 2, 3}, {4, 0, -2}, {0.2f, 1, 0}, 70}, 320, 200);
    HashRng rng(3);
    for (int i = 0; i < 1000; ++i) {
        const int x = int(rng.next_u32() % 320), y = int(rng.next_u32() % 200);
        const Vec2 u{rng.next_float(), rng.next_float()};
        const Ray ray = camera_ray(camera, x, y, u);
        CHECK(length(ray.direction) == doctest::Approx(1));
        const auto pixel = project_point(camera, ray.at(0.5f + 10 * rng.next_float()));
        REQUIRE(pixel);
        CHECK(std::abs(pixel->x - (float(x) + u.x)) < 2e-3f);
        CHECK(std::abs(pixel->y - (float(y) + u.y)) < 2e-3f);
    }
    CHECK_FALSE(project_point(camera, camera.position - camera.forward));
}

namespace {

/// Whether every corner of the box lies within a width x height image.
bool sees_all(const Camera& view, const Box& box, int width, int height) {
    const CameraFrame camera = make_camera(view, width, height);
    for (int i = 0; i < 8; ++i) {
        const Vec3 corner{i & 1 ? box.low.x : box.high.x, i & 2 ? box.low.y : box.high.y,
                          i & 4 ? box.low.z : box.high.z};
        const auto pixel = project_point(camera, corner);
        if (!pixel || pixel->x < 0 || pixel->y < 0) return false;
        if (pixel->x > float(width) || pixel->y > float(height)) return false;
    }
    return true;
}

}  // namespace

TEST_CASE("a camera that sees a box has all its corners in the image, at any scale, aspect and up") {
    for (const float scale : {1e-4f, 1.0f, 1e5f}) {
        Box box;
        box.add(Vec3{-1, 0, 2} * scale);
        box.add(Vec3{5, 0, 3} * scale);
        for (const Vec3 up : {Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
            for (const float aspect : {0.5f, 1.0f, 2.0f}) {
                const Camera view = camera_that_sees(box, up, aspect);
                REQUIRE(check_camera(view));
                CHECK(sees_all(view, box, int(100 * aspect), 100));
                CHECK(dot(view.position - view.look_at, up) > 0);
            }
        }
    }
    CHECK(camera_that_sees(Box{}) == Camera{});
}

TEST_CASE("cameras without an image are refused with a sentence") {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    CHECK_FALSE(check_camera({{1, 1, 1}, {1, 1, 1}, {0, 1, 0}, 45}));
    CHECK_FALSE(check_camera({{0, 0, 0}, {0, 5, 0}, {0, 1, 0}, 45}));
    CHECK_FALSE(check_camera({{0, 0, 0}, {0, 0, 1}, {0, 0, 0}, 45}));
    CHECK_FALSE(check_camera({{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 180}));
    CHECK_FALSE(check_camera({{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, nan}));
    CHECK_FALSE(check_camera({{0, nan, 0}, {0, 0, 1}, {0, 1, 0}, 45}));
    CHECK(check_camera({{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 1}));
}
