#include <cmath>
#include <limits>
#include <utility>

#include "pathscope/filter/atrous.hpp"
#include "pathscope/filter/joint_bilateral.hpp"
#include "pathscope/image/metrics.hpp"
#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

// Error after filtering, against a truth that is known: what a filter takes from noise less what it adds in blur.

namespace {

/// A corner of a room: two walls and a floor, a pattern of two colours on all, in light that fades slowly.
struct Room {
    Image truth, noisy;
    Guides guides;
};

Room make_room(int width, int height, std::uint32_t seed) {
    constexpr int k_tile = 20;
    Room room{Image(width, height),
              Image(width, height),
              {Image(width, height), Image(width, height), Plane(width, height)}};
    HashRng rng(seed);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const float u = float(x) / float(width), v = float(y) / float(height);
            const bool floor = v > 0.6f, left = u < 0.5f;
            const float albedo = (x / k_tile + y / k_tile) % 2 == 0 ? 0.3f : 0.7f;
            room.guides.normal.at(x, y) = floor ? Vec3{0, 1, 0} : left ? Vec3{1, 0, 0} : Vec3{0, 0, 1};
            room.guides.albedo.at(x, y) = {albedo, albedo, albedo};
            room.guides.depth.at(x, y) = floor ? 3 - v : 2 + std::abs(u - 0.5f);
            const float light = (floor ? 2.0f : left ? 1.0f : 0.5f) * (1 + 0.3f * std::sin(4 * u + 3 * v));
            room.truth.at(x, y) = Rgb{1, 0.9f, 0.8f} * (albedo * light);
            // -ln(u) has the mean 1 and the deviation 1: about what one sample of indirect light has.
            room.noisy.at(x, y) = room.truth.at(x, y) * -std::log(1 - rng.next_float());
        }
    }
    return room;
}

/// RMSE before over RMSE after.
double gain(const Room& room, const Image& filtered) {
    return rmse(room.noisy, room.truth) / rmse(filtered, room.truth);
}

}  // namespace

TEST_CASE("the error of a noisy picture falls by as much as the kernels promise, less their blur") {
    const Room room = make_room(240, 160, 1);
    // Noise alone falls by sum(w) / sqrt(sum(w^2)), about 2 sqrt(pi) sigma = 8.9 for a radius of 5 and 12.4 for 7, where
    // no edge is near; the tiles' edges take some of it.
    BilateralParams bilateral;
    for (const auto& [radius, least] : {std::pair(5, 6.0), std::pair(7, 8.0)}) {
        CAPTURE(radius);
        bilateral.radius = radius;
        bilateral.sigma_spatial = float(radius) / 2;
        CHECK(gain(room, joint_bilateral(room.noisy, room.guides, bilateral)) > least);
    }
    AtrousParams wide;
    for (const auto& [levels, least] : {std::pair(3, 10.0), std::pair(4, 14.0), std::pair(5, 18.0)}) {
        CAPTURE(levels);
        wide.levels = levels;
        CHECK(gain(room, atrous(room.noisy, room.guides, wide)) > least);
    }
}

TEST_CASE("without guides the same filters lose in blur what they win") {
    const Room room = make_room(240, 160, 1);
    AtrousParams wide;
    const double with = gain(room, atrous(room.noisy, room.guides, wide));
    const double without = gain(room, atrous(room.noisy, {}, wide));
    CHECK(with > 2 * without);
}

TEST_CASE("with demodulation light is gathered across the edges of a texture") {
    const Room room = make_room(240, 160, 2);
    BilateralParams params;
    const double kept_apart = gain(room, joint_bilateral(room.noisy, room.guides, params));
    params.demodulate_albedo = true;
    params.sigma_albedo = std::numeric_limits<float>::infinity();
    CHECK(gain(room, joint_bilateral(room.noisy, room.guides, params)) > 1.1 * kept_apart);
}
