#include <limits>

#include "pathscope/math/random.hpp"
#include "pathscope/scene/environment.hpp"
#include "statistics.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// 8 texels to a row, most of them black, one very bright, a few of random colours.
Image spotted_picture(int height) {
    Image picture(8, height);
    HashRng rng(11);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < 8; ++x)
            if (rng.next_float() < 0.3f)
                picture.at(x, y) = {rng.next_float(), rng.next_float(), rng.next_float()};
    picture.at(2, 1) = {50, 40, 30};
    return picture;
}

EnvironmentMap make_map(Image picture, float rotate_deg = 0, UpAxis up = UpAxis::y) {
    auto map = make_environment_map("test.hdr", std::move(picture), 1, rotate_deg, up);
    REQUIRE(map);
    return *std::move(map);
}

/// One texel of red in a black picture; which way it lies says how the picture is turned.
EnvironmentMap beacon(int x, int y, float rotate_deg, UpAxis up) {
    Image picture(4, 3);
    picture.at(x, y) = {1, 0, 0};
    return make_map(std::move(picture), rotate_deg, up);
}

Vec3 direction_of_angles(double theta, double phi) {
    return {float(std::sin(theta) * std::cos(phi)), float(std::sin(theta) * std::sin(phi)),
            float(std::cos(theta))};
}

}  // namespace

TEST_CASE("latitude and longitude agree with atan2 and acos, and lead back to the direction") {
    HashRng rng(1);
    for (int i = 0; i < 20'000; ++i) {
        const Vec3 d = direction_of_angles(std::acos(1 - 2 * double(rng.next_float())),
                                           2 * double(k_pi) * rng.next_float());
        const Vec2 uv = lat_long_of(d);
        const double u = 0.5 + std::atan2(double(d.x), -double(d.z)) / (2 * std::numbers::pi);
        const double v = std::atan2(std::hypot(double(d.x), double(d.z)), double(d.y)) / std::numbers::pi;
        CHECK(std::abs(std::remainder(uv.x - u, 1.0)) < 2e-7);
        CHECK(std::abs(uv.y - v) < 2e-7);
        CHECK(length(direction_of_lat_long(uv) - d) < 2e-6f);
    }
    for (const Vec3 pole : {Vec3{0, 1, 0}, Vec3{0, -1, 0}, Vec3{0, 0, 1}, Vec3{-1, 0, 0}}) {
        const Vec2 uv = lat_long_of(pole);
        CHECK(uv.x >= 0);
        CHECK(uv.x < 1);
        CHECK(uv.y >= 0);
        CHECK(uv.y < 1);
    }
}

TEST_CASE("the centre of the picture lies towards -z, its right towards +x, its top towards +y") {
    CHECK(length(direction_of_lat_long({0.5f, 0.5f}) - Vec3{0, 0, -1}) < 1e-6f);
    CHECK(length(direction_of_lat_long({0.75f, 0.5f}) - Vec3{1, 0, 0}) < 1e-6f);
    CHECK(length(direction_of_lat_long({0.3f, 0}) - Vec3{0, 1, 0}) < 1e-6f);
}

TEST_CASE("where z is up the centre lies towards +y, and turning is counter-clockwise from above") {
    // Texel (1, 1) of 4 x 3 has its centre at u = 3/8, v = 1/2: an eighth of a turn left of the middle.
    const float h = std::sqrt(0.5f);
    const auto red = [](const EnvironmentMap& map, Vec3 direction) {
        return environment_map_radiance(map, direction).x;
    };
    CHECK(red(beacon(1, 1, 0, UpAxis::y), {-h, 0, -h}) == doctest::Approx(1));
    CHECK(red(beacon(1, 1, 0, UpAxis::z), {-h, h, 0}) == doctest::Approx(1));
    CHECK(red(beacon(1, 1, 90, UpAxis::y), {-h, 0, h}) == doctest::Approx(1));
    CHECK(red(beacon(1, 1, -270, UpAxis::y), {-h, 0, h}) == doctest::Approx(1));
    CHECK(red(beacon(1, 1, 90, UpAxis::z), {-h, -h, 0}) == doctest::Approx(1));
    CHECK(red(beacon(1, 1, 90, UpAxis::y), {h, 0, h}) == doctest::Approx(0));
}

TEST_CASE("radiance is bilinear, runs around the seam and is held at the poles") {
    Image picture(4, 2);
    for (int x = 0; x < 4; ++x) {
        picture.at(x, 0) = {float(x), 0, 0};
        picture.at(x, 1) = {float(x), 8, 0};
    }
    const EnvironmentMap map = make_map(std::move(picture));
    const auto at = [&](float u, float v) {
        return environment_map_radiance(map, direction_of_lat_long({u, v}));
    };
    CHECK(at(0.375f, 0.25f).x == doctest::Approx(1));
    CHECK(at(0.5f, 0.25f).x == doctest::Approx(1.5));
    CHECK(at(0.9999999f, 0.5f).x == doctest::Approx(1.5));  // Between 3 and 0.
    CHECK(at(0.0f, 0.5f).x == doctest::Approx(1.5));
    CHECK(at(0.375f, 0.5f).y == doctest::Approx(4));
    CHECK(at(0.375f, 0.01f).y == 0);
    CHECK(at(0.375f, 0.99f).y == doctest::Approx(8));
}

TEST_CASE("directions follow their density, also where most of the picture is black") {
    // The rows of three end at z = 1/2 and -1/2, and columns at eighths: at borders of the test's cells, so
    // that the density has no jump within one.
    for (const float rotate : {0.0f, 45.0f}) {
        const EnvironmentMap map = make_map(spotted_picture(3), rotate, UpAxis::z);
        HashRng rng(5);
        const auto sample = [&](int) -> std::optional<Vec3> {
            const Vec2 u{rng.next_float(), rng.next_float()};
            return sample_environment_map(map, u);
        };
        const auto pdf = [&](Vec3 direction) { return sample_environment_map_pdf(map, direction); };
        const SphereTest test = chi_square_sphere(sample, pdf, 100'000, 12, 24);
        CHECK(test.p_value > sidak_threshold(k_significance, 2));
        CHECK(test.pdf_integral == doctest::Approx(1).epsilon(0.001));
    }
}

TEST_CASE("the estimate of all light is unbiased although black texels glow beside bright ones") {
    const EnvironmentMap map = make_map(spotted_picture(6));
    const auto red = [&](Vec3 direction) { return environment_map_radiance(map, direction).x; };
    const double expected = integrate_sphere_patch(red, -1, 1, 0, 2 * std::numbers::pi, 1e-4, 5);

    HashRng rng(6);
    Moments moments;
    double smallest = 1e30;
    for (int i = 0; i < 200'000; ++i) {
        const Vec2 u{rng.next_float(), rng.next_float()};
        const Vec3 direction = sample_environment_map(map, u);
        const double pdf = sample_environment_map_pdf(map, direction);
        smallest = std::min(smallest, pdf);
        moments.add(red(direction) / pdf);
    }
    CHECK(smallest > 0);
    CHECK(std::abs(moments.mean() - expected) < 4 * moments.standard_error());
    CHECK(map.mean_radiance.x == doctest::Approx(expected / (4 * std::numbers::pi)).epsilon(0.02));
}

TEST_CASE("a constant picture is a constant sky of the same mean, and scale multiplies it") {
    auto map = make_environment_map("test.hdr", Image(64, 32, {1, 2, 3}), 2);
    REQUIRE(map);
    CHECK(length(map->mean_radiance - Vec3{2, 4, 6}) < 1e-4f);
    CHECK(environment_map_radiance(*map, {0.6f, 0, 0.8f}) == Vec3{2, 4, 6});
    for (const Vec3 d : {Vec3{0.6f, 0, 0.8f}, Vec3{0.48f, 0.6f, -0.64f}, Vec3{-0.8f, -0.6f, 0}})
        CHECK(sample_environment_map_pdf(*map, d) == doctest::Approx(0.25 / std::numbers::pi).epsilon(0.05));
}

TEST_CASE("pictures that are no environment are refused by name") {
    const auto refused = [](Image picture, float scale = 1) {
        const auto map = make_environment_map("sky.hdr", std::move(picture), scale);
        return !map && map.error().message.starts_with("sky.hdr: ");
    };
    Image negative(4, 2, {1, 1, 1}), infinite = negative;
    negative.at(3, 1).y = -1;
    infinite.at(0, 1).z = std::numeric_limits<float>::infinity();
    CHECK(refused(negative));
    CHECK(refused(infinite));
    CHECK(refused(Image(4, 2)));
    CHECK(refused(Image()));
    CHECK(refused(Image(4, 2, {1, 1, 1}), 0));
    CHECK(refused(Image(4, 2, {1e30f, 1, 1}), 1e30f));
    CHECK_FALSE(refused(Image(1, 1, {1, 1, 1})));
}
