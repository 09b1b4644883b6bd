#include "pathscope/filter/atrous.hpp"

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "filter/filter_pictures.hpp"
#include "pathscope/image/metrics.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr std::array k_spline{3 / 8.0, 1 / 4.0, 1 / 16.0};

/// Normal, depth and albedo have in all filters the same weight: it is taken from the equation of the other one.
double guide_weight(const Guides& guides, const AtrousParams& params, int px, int py, int qx, int qy) {
    BilateralParams same;
    same.radius = k_max_filter_radius;
    same.sigma_spatial = k_inf;
    same.sigma_normal = params.sigma_normal;
    same.sigma_depth = params.sigma_depth;
    same.sigma_albedo = params.sigma_albedo;
    return double(bilateral_weight(guides, same, px, py, qx, qy));
}

/// One level of the equation, one pixel at a time, in double.
Image level_by_equation(const Image& picture, const Guides& guides, const AtrousParams& params, int level) {
    Image out(picture.width, picture.height);
    const double sigma_colour = std::ldexp(double(params.sigma_colour), -level);
    for (int py = 0; py < picture.height; ++py) {
        for (int px = 0; px < picture.width; ++px) {
            double sum[3] = {}, weights = 0;
            for (int dy = -2; dy <= 2; ++dy) {
                for (int dx = -2; dx <= 2; ++dx) {
                    const int qx = px + (dx << level), qy = py + (dy << level);
                    if (!picture.rect().contains(qx, qy)) continue;
                    const double colour = double(length(picture.at(px, py) - picture.at(qx, qy)));
                    const double w = k_spline[std::size_t(std::abs(dx))] *
                                     k_spline[std::size_t(std::abs(dy))] *
                                     std::exp(-0.5 * colour * colour / (sigma_colour * sigma_colour)) *
                                     guide_weight(guides, params, px, py, qx, qy);
                    weights += w;
                    for (int c = 0; c < 3; ++c) sum[c] += w * double(picture.at(qx, qy)[c]);
                }
            }
            for (int c = 0; c < 3; ++c) out.at(px, py)[c] = float(sum[c] / weights);
        }
    }
    return out;
}

Image filtered_by_equation(Image picture, const Guides& guides, const AtrousParams& params) {
    for (int level = 0; level < params.levels; ++level)
        picture = level_by_equation(picture, guides, params, level);
    return picture;
}

float largest_difference(const Image& a, const Image& b) {
    float largest = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i)
        largest = std::max(largest, max_component(abs(a.pixels[i] - b.pixels[i])));
    return largest;
}

}  // namespace

TEST_CASE("the fast passes give what the equation gives, level for level") {
    const int width = 83,
              height = 41;  // More than a strip of the loops, and less than the reach of five levels.
    const Image noisy = random_image(width, height, 1);
    const Guides guides = random_guides(width, height, 2);
    AtrousParams params;
    for (const float sigma_colour : {k_inf, 1.5f}) {
        params.sigma_colour = sigma_colour;
        for (const int levels : {1, 2, 3, 5}) {
            CAPTURE(sigma_colour);
            CAPTURE(levels);
            params.levels = levels;
            const Image filtered = atrous(noisy, guides, params);
            CHECK(largest_difference(filtered, filtered_by_equation(noisy, guides, params)) < 2e-5f);
            CHECK(largest_difference(filtered, noisy) > 0.1f);
        }
    }
}

TEST_CASE("a constant picture stays as it is, whatever the guides") {
    const Image constant(70, 30, {0.3f, 7, 1e-3f});
    AtrousParams params;
    params.sigma_colour = 1;
    for (const Rgb pixel : atrous(constant, random_guides(70, 30, 3), params).pixels)
        for (int c = 0; c < 3; ++c) CHECK(pixel[c] == doctest::Approx(constant.pixels[0][c]).epsilon(1e-5));
}

TEST_CASE("0 levels change no bit") {
    AtrousParams params;
    params.levels = 0;
    const Image noisy = random_image(20, 20, 4);
    CHECK(atrous(noisy, random_guides(20, 20, 5), params) == noisy);
}

TEST_CASE("a point of light spreads as the product of the levels' kernels, and no energy is lost") {
    // Far from all borders and on flat guides each level is a convolution, so that the middle row of the response is the
    // product of the sums of b(dx) b(dx') .. over dx + 2 dx' + .. = x, in x, with the same of 0 in y.
    constexpr int k_levels = 3, k_reach = atrous_reach(k_levels), k_size = 4 * k_reach + 1,
                  k_middle = k_size / 2;
    std::vector<double> line(k_size);
    line[k_middle] = 1;
    for (int level = 0; level < k_levels; ++level) {
        std::vector<double> next(k_size);
        for (int x = 0; x < k_size; ++x)
            for (int dx = -2; dx <= 2; ++dx)
                if (const int from = x + (dx << level); from >= 0 && from < k_size)
                    next[std::size_t(x)] += k_spline[std::size_t(std::abs(dx))] * line[std::size_t(from)];
        line = next;
    }

    Image point(k_size, k_size);
    point.at(k_middle, k_middle) = {1, 2, 4};
    AtrousParams params;
    params.levels = k_levels;
    const Image filtered = atrous(point, flat_guides(k_size, k_size), params);
    double energy = 0;
    for (const Rgb pixel : filtered.pixels) energy += double(pixel.y);
    CHECK(energy == doctest::Approx(2).epsilon(1e-5));
    for (int x = 0; x < k_size; ++x) {
        const double expected = line[std::size_t(x)] * line[k_middle];
        CHECK(double(filtered.at(x, k_middle).x) == doctest::Approx(expected).epsilon(1e-5));
        CHECK((filtered.at(x, k_middle).z > 0) == (std::abs(x - k_middle) <= k_reach));
    }
}

TEST_CASE("an edge in any one guide is kept by all levels") {
    const int width = 64, height = 31, edge = 32;
    Image picture(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = edge; x < width; ++x) picture.at(x, y) = {1, 1, 1};
    const AtrousParams params;
    const auto with_step = [&](const std::string& guide) {
        Guides guides = flat_guides(width, height);
        for (int y = 0; y < height; ++y) {
            for (int x = edge; x < width; ++x) {
                if (guide == "normal") guides.normal.at(x, y) = {1, 0, 0};
                if (guide == "albedo") guides.albedo.at(x, y) = {0.5f, 1.5f, 0.5f};
                if (guide == "depth") guides.depth.at(x, y) *= 2;
            }
        }
        return guides;
    };
    for (const char* guide : {"normal", "albedo", "depth"}) {
        CAPTURE(guide);
        CHECK(largest_difference(atrous(picture, with_step(guide), params), picture) < 3e-5f);
    }
    // Without an edge in any guide it is blurred, unless its height in colour keeps it.
    CHECK(atrous(picture, flat_guides(width, height), params).at(edge, 15).x < 0.6f);
    AtrousParams by_colour = params;
    by_colour.sigma_colour = 0.2f;
    CHECK(largest_difference(atrous(picture, flat_guides(width, height), by_colour), picture) < 3e-5f);
}

TEST_CASE("a pixel that is not a number stays alone") {
    const int width = 40, height = 40;
    Image noisy = random_image(width, height, 7);
    noisy.at(20, 20).x = k_nan;
    Guides guides = flat_guides(width, height);
    guides.normal.at(10, 10).y = k_nan;
    const Image filtered = atrous(noisy, guides, {});
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) CHECK(is_finite(filtered.at(x, y)) == (x != 20 || y != 20));
    CHECK(filtered.at(10, 10) == noisy.at(10, 10));
}

TEST_CASE("demodulation passes texture and blurs the light on it") {
    Guides guides = flat_guides(40, 32);
    HashRng rng(8);
    Image textured(40, 32);
    for (std::size_t i = 0; i < textured.pixels.size(); ++i) {
        guides.albedo.pixels[i] = {0.1f + rng.next_float(), 0.1f + rng.next_float(), 0};
        textured.pixels[i] = guides.albedo.pixels[i] * Rgb{2, 3, 4};  // A constant light.
    }
    AtrousParams params;
    params.sigma_albedo = k_inf;
    CHECK(largest_difference(atrous(textured, guides, params), textured) > 0.5f);
    params.demodulate_albedo = true;
    CHECK(largest_difference(atrous(textured, guides, params), textured) < 3e-5f);
}

TEST_CASE("the same bits for any number of threads") {
    const Image noisy = random_image(150, 71, 9);
    const Guides guides = random_guides(150, 71, 10);
    AtrousParams params;
    params.sigma_colour = 2;
    const Image one = atrous(noisy, guides, params, 1);
    for (const int threads : {2, 3, 8}) CHECK(atrous(noisy, guides, params, threads) == one);
}

TEST_CASE("filtered with an apron as wide as the reach, a part has the frame's bits") {
    const int levels = 3, reach = atrous_reach(levels), width = 120, height = 80;
    const Image noisy = random_image(width, height, 11);
    const Guides guides = random_guides(width, height, 12);
    AtrousParams params;
    params.levels = levels;
    const Image frame = atrous(noisy, guides, params);
    const PixelRect part{37, 21, 20, 17};
    const PixelRect with_apron{part.x - reach, part.y - reach, part.width + 2 * reach,
                               part.height + 2 * reach};
    const Guides cut{crop(guides.normal, with_apron), crop(guides.albedo, with_apron),
                     crop(guides.depth, with_apron)};
    const Image alone = atrous(crop(noisy, with_apron), cut, params);
    CHECK(crop(alone, {reach, reach, part.width, part.height}) == crop(frame, part));
}

TEST_CASE("parameters that make no filter are refused by name") {
    CHECK(bool(check_params(AtrousParams{})));
    AtrousParams params;
    for (const int levels : {-1, k_max_atrous_levels + 1}) {
        params.levels = levels;
        CHECK(check_params(params).error().message.find("levels") != std::string::npos);
    }
    params = {};
    params.sigma_colour = 0;
    CHECK(check_params(params).error().message.find("sigma_colour") != std::string::npos);
    params = {};
    params.sigma_depth = k_nan;
    CHECK(check_params(params).error().message.find("sigma_depth") != std::string::npos);
}
