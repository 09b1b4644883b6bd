#include "pathscope/sampling/distribution.hpp"

#include <numeric>

#include "pathscope/math/random.hpp"
#include "statistics.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

TEST_CASE("nothing to pick from: no distribution") {
    CHECK_FALSE(Distribution1d::make({}).has_value());
    CHECK_FALSE(Distribution1d::make(std::vector<float>{0, 0, 0}).has_value());
    CHECK_FALSE(Distribution2d::make({}, 0, 0).has_value());
    CHECK_FALSE(Distribution2d::make(std::vector<float>(6, 0.0f), 3, 2).has_value());
}

TEST_CASE("what is reported is what happens: over all 2^24 uniform numbers, counts equal the pmf exactly") {
    const std::vector<float> weights{0, 1, 1e-30f, 0, 3, 0.1f, 1e6f, 2e5f, 0, 0};
    const auto distribution = Distribution1d::make(weights);
    REQUIRE(distribution.has_value());
    REQUIRE(distribution->size() == 10);
    std::vector<std::int64_t> counts(weights.size());
    const int step = k_sanitized ? 64 : 1;
    for (int i = 0; i < 1 << 24; i += step) {
        const Distribution1d::Pick pick = distribution->sample(float(i) * 0x1p-24f);
        ++counts[std::size_t(pick.index)];
        if (i % 4096 == 0) REQUIRE(pick.pmf == distribution->pmf(pick.index));
    }
    const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
    for (int i = 0; i < 10; ++i) {
        const float pmf = distribution->pmf(i);
        if (!k_sanitized) CHECK(counts[std::size_t(i)] == std::int64_t(pmf * 0x1p24f));
        CHECK(std::abs(pmf - weights[std::size_t(i)] / total) <= 10 * 0x1p-24);
        CHECK((pmf == 0) == (weights[std::size_t(i)] == 0));
    }
    CHECK(distribution->pmf(2) == 0x1p-24f);
}

TEST_CASE("a million entries: probabilities sum to exactly 1, none is lost") {
    std::vector<float> weights(1 << 20);
    HashRng rng(1);
    for (float& weight : weights) weight = rng.next_float() < 0.1f ? 0 : std::exp(20 * rng.next_float());
    const auto distribution = Distribution1d::make(weights);
    REQUIRE(distribution.has_value());
    double sum = 0;
    int lost = 0;
    for (int i = 0; i < distribution->size(); ++i) {
        sum += distribution->pmf(i);
        lost += (distribution->pmf(i) > 0) != (weights[std::size_t(i)] > 0);
    }
    CHECK(sum == 1);
    CHECK(lost == 0);
    for (int i = 0; i < 10'000; ++i) REQUIRE(distribution->sample(rng.next_float()).pmf > 0);
}

TEST_CASE("picks follow the weights, and what is left of u is uniform (chi-square)") {
    const std::vector<float> weights{1, 2, 0, 4, 8};
    const auto distribution = Distribution1d::make(weights);
    const int n = 100'000;
    std::vector<double> observed(5 * 16), expected(5 * 16);
    HashRng rng(2);
    for (int i = 0; i < n; ++i) {
        const Distribution1d::Pick pick = distribution->sample(rng.next_float());
        REQUIRE(pick.remainder >= 0);
        REQUIRE(pick.remainder < 1);
        ++observed[std::size_t(pick.index * 16 + int(pick.remainder * 16))];
    }
    for (int i = 0; i < 5 * 16; ++i) expected[std::size_t(i)] = n * weights[std::size_t(i / 16)] / 15.0 / 16;
    CHECK(chi_square_test(observed, expected).p_value > sidak_threshold(k_significance, 2));
}

TEST_CASE("a picture of weights: points fall by weight, uniformly within a pixel, and the density agrees") {
    // A sun in a dim sky, a black row, a black column; a width that is no power of two.
    const int width = 7, height = 5;
    std::vector<float> weights(std::size_t(width * height));
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            weights[std::size_t(y * width + x)] = y == 2 || x == 3   ? 0
                                                  : x == 5 && y == 1 ? 40.0f
                                                                     : float(1 + x);
    const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
    const auto distribution = Distribution2d::make(weights, width, height);
    REQUIRE(distribution.has_value());

    const int n = 200'000;
    std::vector<double> observed(weights.size() * 4), expected(weights.size() * 4);
    HashRng rng(3);
    for (int i = 0; i < n; ++i) {
        const float ux = rng.next_float(), uy = rng.next_float();
        const Distribution2d::Pick pick = distribution->sample({ux, uy});
        REQUIRE(pick.point.x < 1);
        REQUIRE(pick.point.y < 1);
        REQUIRE(pick.pdf_square > 0);
        REQUIRE(pick.pdf_square == distribution->pdf_square(pick.point));
        // Four quarters of each pixel.
        const int column = int(pick.point.x * 2 * width), row = int(pick.point.y * 2 * height);
        ++observed[std::size_t(row * 2 * width + column)];
    }
    double integral = 0;
    for (int row = 0; row < 2 * height; ++row)
        for (int column = 0; column < 2 * width; ++column) {
            const float weight = weights[std::size_t(row / 2 * width + column / 2)];
            expected[std::size_t(row * 2 * width + column)] = n * weight / total / 4;
            const Vec2 centre{(float(column) + 0.5f) / (2 * width), (float(row) + 0.5f) / (2 * height)};
            integral += distribution->pdf_square(centre) / (4.0 * width * height);
            CHECK(distribution->pdf_square(centre) ==
                  doctest::Approx(weight / total * width * height).epsilon(1e-4));
        }
    CHECK(integral == doctest::Approx(1).epsilon(1e-6));
    CHECK(chi_square_test(observed, expected).p_value > sidak_threshold(k_significance, 2));
}

TEST_CASE("points at the edges of pixels stay in the pixel they were picked in") {
    // Weights that differ from neighbour to neighbour, so that a point on the wrong side has another density.
    const int width = 49;
    std::vector<float> weights(width);
    for (int i = 0; i < width; ++i) weights[std::size_t(i)] = float(1 + i % 3);
    const auto distribution = Distribution2d::make(weights, width, 1);
    const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
    double sum = 0;
    for (int i = 0; i <= width; ++i) {
        for (int step = -30; step <= 30; ++step) {
            const double u = std::floor(sum / total * 0x1p24 + step) * 0x1p-24;
            if (u < 0 || u >= 1) continue;
            for (const float v : {0.0f, k_one_minus_epsilon}) {
                const Distribution2d::Pick pick = distribution->sample({float(u), v});
                REQUIRE(pick.point.x < 1);
                REQUIRE(pick.point.y < 1);
                REQUIRE(pick.pdf_square == distribution->pdf_square(pick.point));
            }
        }
        if (i < width) sum += weights[std::size_t(i)];
    }
}
