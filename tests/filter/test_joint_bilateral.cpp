#include "pathscope/filter/joint_bilateral.hpp"

#include <cmath>

#include "filter/filter_pictures.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// The equation, one pixel at a time, in double.
Image filtered_by_equation(const Image& noisy, const Guides& guides, const BilateralParams& params) {
    Image out(noisy.width, noisy.height);
    for (int py = 0; py < noisy.height; ++py) {
        for (int px = 0; px < noisy.width; ++px) {
            double sum[3] = {}, weights = 0;
            const int r = params.radius;
            for (int qy = std::max(0, py - r); qy <= std::min(noisy.height - 1, py + r); ++qy) {
                for (int qx = std::max(0, px - r); qx <= std::min(noisy.width - 1, px + r); ++qx) {
                    const double w = double(bilateral_weight(guides, params, px, py, qx, qy));
                    weights += w;
                    for (int c = 0; c < 3; ++c) sum[c] += w * double(noisy.at(qx, qy)[c]);
                }
            }
            for (int c = 0; c < 3; ++c) out.at(px, py)[c] = float(sum[c] / weights);
        }
    }
    return out;
}

float largest_difference(const Image& a, const Image& b) {
    float largest = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i)
        largest = std::max(largest, max_component(abs(a.pixels[i] - b.pixels[i])));
    return largest;
}

}  // namespace

TEST_CASE("the weight is the Gaussian of the equation, number by number") {
    Guides guides = flat_guides(4, 1);
    BilateralParams params;
    params.radius = 2;
    params.sigma_spatial = 2;
    params.sigma_normal = 0.5f;
    params.sigma_depth = 0.1f;
    params.sigma_albedo = 0.25f;
    const auto weight = [&] { return double(bilateral_weight(guides, params, 0, 0, 2, 0)); };

    CHECK(weight() == doctest::Approx(std::exp(-0.5 * 4 / 4)));
    CHECK(bilateral_weight(guides, params, 0, 0, 0, 0) == 1);
    CHECK(bilateral_weight(guides, params, 0, 0, 3, 0) == 0);  // Beyond the radius.

    guides.normal.at(2, 0) = {0.6f, 0, 0.8f};  // |n - n'|^2 = 2 - 2 cos = 0.4
    CHECK(weight() == doctest::Approx(std::exp(-0.5 * (1 + 0.4 / 0.25))));
    guides.albedo.at(2, 0) = {0.5f, 0.25f, 0.5f};
    CHECK(weight() == doctest::Approx(std::exp(-0.5 * (1 + 1.6 + 1))));
    guides.depth.at(2, 0) = 3 * std::exp(0.2f);
    CHECK(weight() == doctest::Approx(std::exp(-0.5 * (1 + 1.6 + 1 + 4))).epsilon(1e-4));

    guides.depth.at(2, 0) = k_inf;
    CHECK(weight() == 0);
    guides.depth.at(0, 0) = 0;  // Both are sky: depth has no more to say.
    CHECK(weight() == doctest::Approx(std::exp(-0.5 * (1 + 1.6 + 1))));
    params.sigma_normal = params.sigma_albedo = k_inf;
    CHECK(weight() == doctest::Approx(std::exp(-0.5)));
    guides.albedo.at(2, 0).x = k_nan;
    CHECK(weight() == 0);
}

TEST_CASE("the fast loops give what the equation gives") {
    const int width = 37, height = 23;
    const Image noisy = random_image(width, height, 1);
    const Guides guides = random_guides(width, height, 2);
    constexpr float k_rounding = 1e-5f;  // Sums of up to 851 floats, of values up to 4.
    BilateralParams params;
    for (const int radius : {1, 4, 40}) {  // 40 reaches beyond the picture from everywhere.
        CAPTURE(radius);
        params.radius = radius;
        params.sigma_spatial = 0.5f * float(radius);
        const Image filtered = joint_bilateral(noisy, guides, params);
        CHECK(largest_difference(filtered, filtered_by_equation(noisy, guides, params)) < k_rounding);
        CHECK(largest_difference(filtered, noisy) > 0.1f);
    }
    params.radius = 3;
    const Image wide = random_image(300, 9, 13);  // Wider than what the loops take at once.
    const Guides wide_guides = random_guides(300, 9, 14);
    CHECK(largest_difference(joint_bilateral(wide, wide_guides, params),
                             filtered_by_equation(wide, wide_guides, params)) < k_rounding);
    const Guides no_guides;
    CHECK(largest_difference(joint_bilateral(noisy, no_guides, params),
                             filtered_by_equation(noisy, no_guides, params)) < k_rounding);
}

TEST_CASE("a constant picture stays as it is, whatever the guides") {
    const Image constant(40, 30, {0.3f, 7, 1e-3f});
    const Image filtered = joint_bilateral(constant, random_guides(40, 30, 3), {});
    for (const Rgb pixel : filtered.pixels)
        for (int c = 0; c < 3; ++c) CHECK(pixel[c] == doctest::Approx(constant.pixels[0][c]).epsilon(1e-5));
}

TEST_CASE("radius 0 changes no bit") {
    BilateralParams params;
    params.radius = 0;
    params.demodulate_albedo = true;
    const Image noisy = random_image(20, 20, 4);
    CHECK(joint_bilateral(noisy, random_guides(20, 20, 5), params) == noisy);
}

TEST_CASE("an edge in any one guide is kept, and bleeds by the weight across it") {
    // Black on the left of x = 16, 1 on the right. In the middle of a tall picture every row is the same, so the
    // filter acts in x alone: out(x) = sum over the right of s(dx) e / (sum over own side of s(dx) + e times the
    // other side), with s the spatial weight and e = exp(-1/2 (step / sigma)^2) the weight across the edge.
    const int width = 32, height = 31, edge = 16;
    BilateralParams params;
    params.radius = 5;
    params.sigma_spatial = 3;
    Image picture(width, height);
    for (int y = 0; y < height; ++y)
        for (int x = edge; x < width; ++x) picture.at(x, y) = {1, 1, 1};

    const auto with_step = [&](const std::string& guide, float sigmas) {
        Guides guides = flat_guides(width, height);
        for (int y = 0; y < height; ++y) {
            for (int x = edge; x < width; ++x) {
                if (guide == "normal") guides.normal.at(x, y) += Vec3{sigmas * params.sigma_normal, 0, 0};
                if (guide == "albedo") guides.albedo.at(x, y) += Rgb{0, sigmas * params.sigma_albedo, 0};
                if (guide == "depth") guides.depth.at(x, y) *= std::exp(sigmas * params.sigma_depth);
            }
        }
        return guides;
    };
    for (const char* guide : {"normal", "albedo", "depth"}) {
        for (const float sigmas : {1.0f, 2.0f, 3.0f, 13.0f}) {
            CAPTURE(guide);
            CAPTURE(sigmas);
            const Image filtered = joint_bilateral(picture, with_step(guide, sigmas), params);
            const double across = std::exp(-0.5 * double(sigmas) * double(sigmas));
            for (int x = edge - 6; x < edge + 6; ++x) {
                double left = 0, right = 0;
                for (int dx = -params.radius; dx <= params.radius; ++dx) {
                    const double spatial = std::exp(-0.5 * dx * dx / 9.0);
                    (x + dx < edge ? left : right) += spatial;
                }
                (x < edge ? right : left) *= across;
                CHECK(filtered.at(x, 15).x == doctest::Approx(right / (left + right)).epsilon(2e-5));
            }
            if (sigmas == 13.0f) CHECK(largest_difference(filtered, picture) < 1e-6f);
        }
    }
    // Without an edge in any guide the same picture is blurred.
    CHECK(joint_bilateral(picture, flat_guides(width, height), params).at(edge, 15).x < 0.6f);
}

TEST_CASE("surface and sky do not mix, even with depth switched off") {
    const int width = 20, height = 9;
    Image picture(width, height, {1, 1, 1});
    Guides guides = flat_guides(width, height);
    for (int y = 0; y < height; ++y) {
        for (int x = 10; x < width; ++x) {
            picture.at(x, y) = {5, 5, 5};
            guides.depth.at(x, y) = x % 2 ? 0 : k_inf;
        }
    }
    BilateralParams params;
    params.sigma_depth = k_inf;
    CHECK(largest_difference(joint_bilateral(picture, guides, params), picture) < 3e-6f);
}

TEST_CASE("on a flat region the variance falls by sum(w^2) / (sum w)^2") {
    const int width = 256, height = 256;
    BilateralParams params;
    params.radius = 4;
    params.sigma_spatial = 2;
    const Image noisy = random_image(width, height, 6);  // Uniform: variance 1/12 in red and green.
    const Guides guides = flat_guides(width, height);
    const Image filtered = joint_bilateral(noisy, guides, params);

    double sum = 0, sum_of_squares = 0;
    for (int dy = -4; dy <= 4; ++dy) {
        for (int dx = -4; dx <= 4; ++dx) {
            const double w = std::exp(-0.5 * (dx * dx + dy * dy) / 4.0);
            sum += w;
            sum_of_squares += w * w;
        }
    }
    const double expected = sum_of_squares / (sum * sum) / 12;

    // Pixels nine apart share no neighbour, so these are n independent values of two channels. The variance of a
    // variance of (nearly) normal values is 2 v^2 / (n - 1); 4 standard errors have p = 6e-5.
    double mean = 0, square = 0;
    int n = 0;
    for (int y = 4; y < height - 4; y += 9) {
        for (int x = 4; x < width - 4; x += 9) {
            for (const float value : {filtered.at(x, y).x, filtered.at(x, y).y}) {
                mean += double(value);
                square += double(value) * double(value);
                ++n;
            }
        }
    }
    mean /= n;
    const double variance = (square / n - mean * mean) * n / (n - 1);
    CHECK(n > 1500);
    CHECK(std::abs(variance - expected) < 4 * expected * std::sqrt(2.0 / (n - 1)));
    CHECK(std::abs(mean - 0.5) < 4 * std::sqrt(expected / n));
}

TEST_CASE("a pixel that is not a number stays alone") {
    const int width = 21, height = 21;
    const Image noisy = random_image(width, height, 7);
    const Guides guides = flat_guides(width, height);
    const auto check_alone = [&](const Image& changed, const Guides& changed_guides) {
        BilateralParams params;
        params.radius = 3;
        const Image filtered = joint_bilateral(changed, changed_guides, params);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                if (x != 10 || y != 10) CHECK(is_finite(filtered.at(x, y)));
        // Copied through, where its own colour is a number; a neighbour is the mean of all others.
        if (is_finite(changed.at(10, 10))) CHECK(filtered.at(10, 10) == changed.at(10, 10));
        if (!is_finite(changed.at(10, 10))) CHECK_FALSE(is_finite(filtered.at(10, 10)));
        double sum = 0, weights = 0;
        for (int dy = -3; dy <= 3; ++dy) {
            for (int dx = -3; dx <= 3; ++dx) {
                if (dx == -1 && dy == 0) continue;
                const double w = std::exp(-0.5 * (dx * dx + dy * dy) / (3.5 * 3.5));
                weights += w;
                sum += w * double(noisy.at(11 + dx, 10 + dy).x);
            }
        }
        CHECK(filtered.at(11, 10).x == doctest::Approx(sum / weights).epsilon(1e-5));
    };
    for (const float bad : {k_nan, k_inf, -k_inf}) {
        Guides normal = guides, albedo = guides;
        normal.normal.at(10, 10).y = bad;
        albedo.albedo.at(10, 10).z = bad;
        check_alone(noisy, normal);
        check_alone(noisy, albedo);
        Image colour = noisy;
        colour.at(10, 10).x = bad;
        check_alone(colour, guides);
    }
    Guides depth = guides;
    depth.depth.at(10, 10) = k_nan;
    check_alone(noisy, depth);
}

TEST_CASE("demodulation passes texture and blurs the light on it") {
    const int width = 32, height = 32;
    Guides guides = flat_guides(width, height);
    HashRng rng(8);
    Image textured(width, height);
    for (std::size_t i = 0; i < textured.pixels.size(); ++i) {
        guides.albedo.pixels[i] = {rng.next_float(), 0.02f + rng.next_float(), 0};
        textured.pixels[i] = guides.albedo.pixels[i] * Rgb{2, 3, 4};  // A constant light.
    }
    BilateralParams params;
    params.sigma_albedo = k_inf;
    CHECK(largest_difference(joint_bilateral(textured, guides, params), textured) > 0.5f);
    params.demodulate_albedo = true;
    const Image filtered = joint_bilateral(textured, guides, params);
    for (std::size_t i = 0; i < textured.pixels.size(); ++i) {
        CHECK(filtered.pixels[i].y == doctest::Approx(textured.pixels[i].y).epsilon(1e-5));
        CHECK(filtered.pixels[i].z == 0);
    }
}

TEST_CASE("the same bits for any number of threads") {
    const Image noisy = random_image(300, 41, 9);
    const Guides guides = random_guides(300, 41, 10);
    const Image one = joint_bilateral(noisy, guides, {}, 1);
    for (const int threads : {2, 3, 8}) CHECK(joint_bilateral(noisy, guides, {}, threads) == one);
}

TEST_CASE("a block filtered alone is the frame's filter away from its border, and differs at it") {
    const int width = 150, height = 70;
    const PixelRect block{64, 32, 32, 32};
    const Image noisy = random_image(width, height, 11);
    const Guides guides = random_guides(width, height, 12);
    BilateralParams params;
    params.radius = 5;
    params.sigma_normal = params.sigma_albedo = k_inf;
    const Image frame = joint_bilateral(noisy, guides, params);
    const Image alone = joint_bilateral(noisy, guides, params, block);
    REQUIRE(alone.rect() == PixelRect{0, 0, 32, 32});
    const PixelRect inner{5, 5, 22, 22};
    int seams = 0;
    for (int y = 0; y < 32; ++y) {
        for (int x = 0; x < 32; ++x) {
            const bool same = alone.at(x, y) == frame.at(block.x + x, block.y + y);
            if (inner.contains(x, y)) CHECK(same);
            seams += !same;
        }
    }
    CHECK(seams > 200);  // Of 540 pixels near the border.
}

TEST_CASE("parameters that make no filter are refused by name") {
    CHECK(bool(check_params({})));
    BilateralParams params;
    for (const int radius : {-1, k_max_filter_radius + 1}) {
        params.radius = radius;
        CHECK(check_params(params).error().message.find("radius") != std::string::npos);
    }
    const auto refused = [](float BilateralParams::*sigma, const char* name) {
        for (const float bad : {0.0f, -1.0f, k_nan, 1e-4f}) {
            BilateralParams changed;
            changed.*sigma = bad;
            CHECK(check_params(changed).error().message.find(name) != std::string::npos);
        }
        BilateralParams off;
        off.*sigma = k_inf;
        CHECK(bool(check_params(off)));
    };
    refused(&BilateralParams::sigma_spatial, "sigma_spatial");
    refused(&BilateralParams::sigma_normal, "sigma_normal");
    refused(&BilateralParams::sigma_depth, "sigma_depth");
    refused(&BilateralParams::sigma_albedo, "sigma_albedo");
}
