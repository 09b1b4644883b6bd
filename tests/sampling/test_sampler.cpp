#include "pathscope/sampling/sampler.hpp"

#include <functional>
#include <set>
#include <vector>

#include "statistics.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr SamplerKind k_kinds[] = {SamplerKind::independent, SamplerKind::sobol};

/// P of a chi-square test of n points in the unit square against uniform, on a grid of side x side cells.
double uniformity_p(int side, int n, const std::function<Vec2(int)>& point) {
    std::vector<double> observed(std::size_t(side * side)),
        expected(observed.size(), double(n) / (side * side));
    for (int i = 0; i < n; ++i) {
        const Vec2 p = point(i);
        ++observed[std::size_t(int(p.y * float(side)) * side + int(p.x * float(side)))];
    }
    return chi_square_test(observed, expected).p_value;
}

/// True if n = 2^k points have exactly one in each box of 2^-a by 2^-(k-a), for every a.
bool is_net(const std::vector<Vec2>& points, int k) {
    for (int a = 0; a <= k; ++a) {
        std::set<std::pair<int, int>> boxes;
        for (const Vec2 p : points) boxes.insert({int(std::ldexp(p.x, a)), int(std::ldexp(p.y, k - a))});
        if (boxes.size() != points.size()) return false;
    }
    return true;
}

}  // namespace

TEST_CASE("sampler names go both ways") {
    for (const SamplerKind kind : k_kinds) CHECK(from_name<SamplerKind>(name_of(kind)) == kind);
}

TEST_CASE(
    "a sample's numbers are a pure function of (seed, x, y, sample, dimension), each of which matters") {
    for (const SamplerKind kind : k_kinds) {
        const PixelSampler sampler(kind, 1, 2, 3, 4);
        const Vec2 value = sampler.get_2d(5);
        (void)sampler.get_1d(0);
        CHECK(sampler.get_2d(5) == value);
        CHECK(PixelSampler(kind, 1, 2, 3, 4).get_2d(5) == value);
        CHECK(sampler.get_1d(5) == value.x);
        CHECK_FALSE(PixelSampler(kind, 0, 2, 3, 4).get_2d(5) == value);
        CHECK_FALSE(PixelSampler(kind, 1, 3, 2, 4).get_2d(5) == value);
        CHECK_FALSE(PixelSampler(kind, 1, 2, 3, 5).get_2d(5) == value);
        CHECK_FALSE(sampler.get_2d(6) == value);
    }
}

TEST_CASE("four dimensions at once are the same numbers, bit for bit") {
    for (const SamplerKind kind : k_kinds)
        for (std::uint32_t sample = 0; sample < 1000; ++sample) {
            const PixelSampler sampler(kind, 7, int(sample % 31), int(sample % 17), sample * 977);
            const std::uint32_t first = sample % 13;
            const FourPairs pairs = sampler.get_four_2d(first);
            for (std::uint32_t i = 0; i < 4; ++i) REQUIRE(pairs[i] == sampler.get_2d(first + i));
        }
}

TEST_CASE("Sobol's second coordinate in five steps equals its direction numbers, bit by bit") {
    // v_0 = 1/2, v_j = v_(j-1) xor v_(j-1)/2: the definition, one index bit at a time.
    HashRng rng(5);
    for (int i = 0; i < 1000; ++i) {
        const std::uint32_t index = i < 256 ? std::uint32_t(i) : rng.next_u32();
        std::uint32_t sum = 0, direction = 0x80000000u;
        for (int j = 0; j < 32; ++j, direction ^= direction >> 1)
            if ((index >> j) & 1) sum ^= direction;
        REQUIRE(reverse_bits(sobol_second_reversed(index)) == sum);
    }
}

TEST_CASE(
    "the scramble is nested: a bit depends on itself and on the bits below it only, and is a bijection") {
    HashRng rng(6);
    for (int i = 0; i < 1000; ++i) {
        const std::uint32_t x = rng.next_u32(), key = rng.next_u32();
        const int bit = i % 32;
        const std::uint32_t change = scramble_reversed(x, key) ^ scramble_reversed(x ^ (1u << bit), key);
        REQUIRE((change & ((2u << bit) - 1)) == (1u << bit));
    }
}

TEST_CASE(
    "sobol: the first 2^k samples of any pixel and pair are a (0,k,2)-net; so is each later run of 2^k") {
    for (int pixel = 0; pixel < 12; ++pixel)
        for (const int k : {0, 1, 2, 5, 8, 10}) {
            for (const std::uint32_t run : {0u, 1u, 5u, 1000u}) {
                std::vector<Vec2> points;
                for (std::uint32_t s = 0; s < (1u << k); ++s)
                    points.push_back(PixelSampler(SamplerKind::sobol, 9, pixel * 7, -pixel, (run << k) + s)
                                         .get_2d(pixel * 3u));
                REQUIRE(is_net(points, k));
            }
        }
    // The test can fail: independent points are no net.
    std::vector<Vec2> points;
    for (std::uint32_t s = 0; s < 32; ++s)
        points.push_back(PixelSampler(SamplerKind::independent, 9, 0, 0, s).get_2d(0));
    CHECK_FALSE(is_net(points, 5));
}

TEST_CASE("uniform in the square: over samples of a pixel, and over pixels of a sample") {
    const int n = 1 << 14;
    const double threshold = sidak_threshold(k_significance, 2 * 2 * 8);
    for (const SamplerKind kind : k_kinds)
        for (std::uint32_t d = 0; d < 8; ++d) {
            CHECK(uniformity_p(16, n, [&](int i) {
                      return PixelSampler(kind, 11, 100, 50, std::uint32_t(i)).get_2d(d);
                  }) > threshold);
            CHECK(uniformity_p(16, n, [&](int i) {
                      return PixelSampler(kind, 11, i % 128, i / 128, 3).get_2d(d);
                  }) > threshold);
        }
}

TEST_CASE(
    "S9: no relation between pairs, between neighbouring pixels, between seeds, between successive samples") {
    // One coordinate of each of two points, as a point of the square: uniform if the two are independent.
    // Under sobol each margin is stratified, so the statistic can only be smaller than chi-square's.
    const int n = 1 << 13;
    const double threshold = sidak_threshold(k_significance, 2 * 4 * 8 + 2);
    for (const SamplerKind kind : k_kinds) {
        const auto at = [kind](int x, int y, std::uint32_t sample, std::uint32_t d, std::uint32_t seed = 4) {
            return PixelSampler(kind, seed, x, y, sample).get_2d(d);
        };
        for (std::uint32_t d = 0; d < 8; ++d) {
            const auto pairs = [&](int i) {
                const std::uint32_t s = std::uint32_t(i);
                return Vec2{at(7, 9, s, d).y, at(7, 9, s, d + 1).x};
            };
            const auto same_coordinate = [&](int i) {
                const std::uint32_t s = std::uint32_t(i);
                return Vec2{at(7, 9, s, d).x, at(7, 9, s, d + 1).x};
            };
            const auto neighbours = [&](int i) {
                const std::uint32_t s = std::uint32_t(i);
                return Vec2{at(20, 30, s, d).x, at(21, 30, s, d).x};
            };
            const auto seeds = [&](int i) {
                const std::uint32_t s = std::uint32_t(i);
                return Vec2{at(20, 30, s, d, 1).y, at(20, 30, s, d, 2).y};
            };
            CHECK(uniformity_p(16, n, pairs) > threshold);
            CHECK(uniformity_p(16, n, same_coordinate) > threshold);
            CHECK(uniformity_p(16, n, neighbours) > threshold);
            CHECK(uniformity_p(16, n, seeds) > threshold);
        }
        // Over a picture at one sample: each pixel with the next.
        CHECK(uniformity_p(16, n, [&](int i) {
                  const int x = 2 * (i % 64), y = i / 64;
                  return Vec2{at(x, y, 0, 0).x, at(x + 1, y, 0, 0).x};
              }) > threshold);
    }
}

TEST_CASE("correlation of pairs is that of chance at small sample counts too") {
    // 16 samples a pixel, 2048 pixels: were the pairs of a pixel visited in one order, the products would show.
    for (const SamplerKind kind : k_kinds) {
        Moments products;
        for (int pixel = 0; pixel < 2048; ++pixel) {
            double sum = 0;
            for (std::uint32_t s = 0; s < 16; ++s) {
                const PixelSampler sampler(kind, 1, pixel % 64, pixel / 64, s);
                sum += (sampler.get_2d(2).x - 0.5) * (sampler.get_2d(3).x - 0.5);
            }
            products.add(sum);
        }
        CHECK(normal_two_sided_p(products.mean() / products.standard_error()) >
              sidak_threshold(k_significance, 2));
    }
}

TEST_CASE("each pixel errs on its own: over many pixels, the means of eight samples average to the answer") {
    // Were neither the order nor the scramble a pixel's own, all pixels would share one error.
    for (const SamplerKind kind : k_kinds) {
        Moments first, second;
        for (int pixel = 0; pixel < 4096; ++pixel) {
            double x2 = 0, y2 = 0;
            for (std::uint32_t s = 0; s < 8; ++s) {
                const Vec2 u = PixelSampler(kind, 3, pixel % 64, pixel / 64, s).get_2d(1);
                x2 += u.x * u.x / 8;
                y2 += u.y * u.y / 8;
            }
            first.add(x2);
            second.add(y2);
        }
        for (const Moments& mean : {first, second}) {
            REQUIRE(mean.standard_error() > 0);
            CHECK(normal_two_sided_p((mean.mean() - 1.0 / 3) / mean.standard_error()) >
                  sidak_threshold(k_significance, 4));
        }
    }
}

TEST_CASE("sobol beats independent on a smooth integrand: variance at 256 samples is below 1/1000") {
    // The integral of x e^(x y) over the square is e - 2. Independent: variance 0.27 / n.
    const double answer = std::exp(1.0) - 2;
    double variance[2];
    for (const SamplerKind kind : k_kinds) {
        Moments squared_error;
        for (int pixel = 0; pixel < 256; ++pixel) {
            double sum = 0;
            for (std::uint32_t s = 0; s < 256; ++s) {
                const Vec2 u = PixelSampler(kind, 2, pixel, 0, s).get_2d(1);
                sum += u.x * std::exp(u.x * u.y);
            }
            squared_error.add((sum / 256 - answer) * (sum / 256 - answer));
        }
        variance[int(kind)] = squared_error.mean();
    }
    CAPTURE(variance[0]);
    CAPTURE(variance[1]);
    CHECK(variance[1] < variance[0] / 1000);
}

TEST_CASE("sequences of a pixel err on their own: the means of their first samples are not correlated") {
    // Over n pixels the correlation of independent means has a standard deviation of 1 / sqrt(n). Two halves of one
    // sequence of sobol would give -0.9 here: they share its strata.
    constexpr int k_pixels = 20'000;
    for (const SamplerKind kind : k_kinds)
        for (const std::uint32_t other : {1u, 2u, 3u}) {
            double covariance = 0, variance = 0;
            for (int x = 0; x < k_pixels; ++x) {
                const auto mean = [&](std::uint32_t sequence) {
                    double sum = 0;
                    for (std::uint32_t s = 0; s < 2; ++s)
                        sum +=
                            double(PixelSampler(kind, 1, x, 0, sequence * k_sequence_samples + s).get_1d(3));
                    return sum / 2 - 0.5;
                };
                const double a = mean(0), b = mean(other);
                covariance += a * b;
                variance += a * a;
            }
            CHECK(std::abs(covariance / variance) < 4 / std::sqrt(double(k_pixels)));
        }
}

TEST_CASE("numbers stay below 1 and are multiples of 2^-24") {
    for (const SamplerKind kind : k_kinds)
        for (std::uint32_t s = 0; s < 100'000; ++s) {
            const float u = PixelSampler(kind, 0, 0, 0, s * 40503u).get_1d(s);
            REQUIRE(u >= 0);
            REQUIRE(u < 1);
            REQUIRE(u * 0x1p24f == std::floor(u * 0x1p24f));
        }
}
