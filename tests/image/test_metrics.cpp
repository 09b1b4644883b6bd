#include "pathscope/image/metrics.hpp"

#include <cmath>
#include <limits>

#include "pathscope/image/io.hpp"
#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

float gaussian(HashRng& rng) {  // Box & Muller.
    return std::sqrt(-2 * std::log(1 - rng.next_float())) * std::cos(2 * k_pi * rng.next_float());
}

/// mean + noise, as n samples of the given variance leave it.
Image noisy_mean(HashRng& rng, const Image& expected, const Image& variance, int n) {
    Image image = expected;
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        for (int c = 0; c < 3; ++c)
            image.pixels[i][c] += std::sqrt(variance.pixels[i][c] / float(n)) * gaussian(rng);
    return image;
}

}  // namespace

TEST_CASE("mean, RMSE and relMSE of four numbers done by hand") {
    const Image a(2, 1, {{1, 2, 3}, {4, 5, 6}});
    const Image b(2, 1, {{1, 2, 3}, {4, 5, 9}});
    CHECK(mean(a) == doctest::Approx(3.5));
    CHECK(rmse(a, b) == doctest::Approx(std::sqrt(9.0 / 6)));
    CHECK(rmse(a, a) == 0);
    CHECK(rel_mse(a, b) == doctest::Approx(9 / 81.01 / 6));
    CHECK(rel_mse(a, b, {1.0, 0}) == doctest::Approx(9 / 82.0 / 6));
    CHECK(rel_mse(a, b, {0.01, 0.2}) == 0);  // A fifth of six terms is one: the only one that is not 0.
    const Image broken(2, 1, {{std::nanf(""), 2, 3}, {4, 5, 6}});
    CHECK(std::isnan(rmse(broken, a)));
    CHECK(std::isnan(rel_mse(broken, a, {0.01, 0.5})));
    CHECK(std::isnan(compare_blocks(broken, a, 1).median));
}

TEST_CASE("block comparison: one block of 64 off by 50 %") {
    Image reference(64, 64, {1, 1, 1}), image = reference;
    for (int y = 8; y < 16; ++y)
        for (int x = 16; x < 24; ++x) image.at(x, y) = {1.5f, 1.5f, 1.5f};
    const BlockComparison comparison = compare_blocks(image, reference);
    CHECK(comparison.median == 0);
    CHECK(comparison.percentile_95 == 0);  // One block is 1.6 % of all.
    CHECK(comparison.ratio_of_means == doctest::Approx(1 + 0.5 / 64));
    CHECK(comparison.close());
    CHECK(compare_blocks(image, reference, 64).median == doctest::Approx(0.5 / 64 / 1.01));
}

TEST_CASE("block comparison: each of the three limits can fail alone") {
    const Image reference(64, 64, {1, 1, 1});
    const auto with_blocks = [&](int blocks, float factor, float others) {
        Image image(64, 64, {others, others, others});
        for (int block = 0; block < blocks; ++block)
            for (int i = 0; i < 64; ++i)
                image.at(block % 8 * 8 + i % 8, block / 8 * 8 + i / 8) = {factor, factor, factor};
        return compare_blocks(image, reference);
    };
    const BlockComparison median = with_blocks(32, 1.03f, 0.97f);
    CHECK(median.median > 0.02);
    CHECK(std::abs(median.ratio_of_means - 1) < 0.01);
    CHECK_FALSE(median.close());

    const BlockComparison percentile = with_blocks(4, 1.1f, 1);  // 6 % of all blocks.
    CHECK(percentile.percentile_95 > 0.08);
    CHECK(percentile.median == 0);
    CHECK(std::abs(percentile.ratio_of_means - 1) < 0.01);
    CHECK_FALSE(percentile.close());

    const BlockComparison bias = with_blocks(64, 1.015f, 1);
    CHECK(bias.median < 0.02);
    CHECK_FALSE(bias.close());
    CHECK(with_blocks(64, 1.005f, 1).close());
}

TEST_CASE("pixels that fill no whole block are left out of blocks, not of the means") {
    Image reference(20, 9, {1, 1, 1}), image = reference;
    for (int y = 0; y < 9; ++y)
        for (int x = 0; x < 20; ++x)
            if (x >= 16 || y < 1) image.at(x, y) = {100, 100, 100};
    const BlockComparison comparison = compare_blocks(image, reference);
    CHECK(comparison.percentile_95 == 0);
    CHECK(comparison.ratio_of_means > 2);
}

TEST_CASE("the limit for z is the normal distribution's") {
    CHECK(sidak_z_limit(1, 0.05) == doctest::Approx(1.959964).epsilon(1e-6));
    CHECK(sidak_z_limit(1, 0.01) == doctest::Approx(2.575829).epsilon(1e-6));
    // P(largest of m below z) = P(one below z)^m, asked the other way round.
    for (const double m : {10.0, 1e3, 1e6}) {
        const double one_below = std::erf(sidak_z_limit(std::int64_t(m), 0.01) / std::sqrt(2.0));
        CHECK(std::pow(one_below, m) == doctest::Approx(0.99).epsilon(1e-7));
    }
}

TEST_CASE("z: equal expectations pass, a bias in one pixel does not") {
    HashRng rng(11);
    Image expected(64, 64), variance(64, 64);
    for (std::size_t i = 0; i < expected.pixels.size(); ++i) {
        expected.pixels[i] = {rng.next_float(), rng.next_float(), rng.next_float()};
        variance.pixels[i] = {rng.next_float(), 4 * rng.next_float(), 0.1f};
    }
    const int n_a = 4096, n_b = 1024;
    const Image a = noisy_mean(rng, expected, variance, n_a), b = noisy_mean(rng, expected, variance, n_b);
    const double limit = sidak_z_limit(3 * 64 * 64, 1e-3);
    const double z = max_abs_z(a, variance, n_a, b, variance, n_b);
    CHECK(z < limit);
    CHECK(z > 3);  // The largest of 12,288: below 3 with probability (1 - 0.0027)^12288 = 4e-15.

    Image biased = a;  // By 0.4 of the standard deviation of one sample, in one channel of one pixel.
    biased.at(30, 30).y += 0.4f * std::sqrt(variance.at(30, 30).y);
    CHECK(max_abs_z(biased, variance, n_a, b, variance, n_b) > limit);
}

TEST_CASE("z without variance: equal is 0, different is infinite, not a number stays") {
    const Image zero(1, 1), one(1, 1, {1, 0, 0}), nan(1, 1, {std::nanf(""), 0, 0});
    CHECK(max_abs_z(one, zero, 1, one, zero, 1) == 0);
    CHECK(std::isinf(max_abs_z(one, zero, 1, zero, zero, 1)));
    CHECK(std::isnan(max_abs_z(nan, one, 1, one, one, 1)));
}

TEST_CASE("a reference by another renderer is close to itself and far from another scene") {
    const auto folder = testing::shared_folder();
    if (folder.empty()) {
        MESSAGE("skipped: no ../shared");
        return;
    }
    const auto sponza = load_image(folder / "reference/dabrovic_sponza.pfm");
    const auto conference = load_image(folder / "reference/conference.pfm");
    REQUIRE(bool(sponza));
    REQUIRE(bool(conference));
    CHECK(sponza->width == 320);
    CHECK(sponza->height == 180);
    CHECK(compare_blocks(*sponza, *sponza).close());
    CHECK_FALSE(compare_blocks(*conference, *sponza).close());
}
