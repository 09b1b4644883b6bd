#include "pathscope/render/scout.hpp"

#include <cmath>

#include "pathscope/image/wire_format.hpp"
#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

constexpr Quantum k_quantum{-4};

/// All pixels of a block hold `sum` quanta in each channel, of `count` samples.
void fill(FrameSums& frame, std::uint32_t block, std::int64_t sum, std::uint32_t count) {
    const Round round = frame.grid().round(block, 0, count);
    frame.add(round, std::vector(std::size_t(round.rect.area()), PixelSum{sum, sum, sum}));
}

}  // namespace

TEST_CASE("variance of one sample and mean of the frame, on paper") {
    const BlockGrid grid(3, 2, 2);  // Blocks of four pixels and of two.
    FrameSums half0(grid, k_quantum), half1(grid, k_quantum);
    fill(half0, 0, 4 * 32, 4);  // Means 2 and 5, of four samples each: 3^2 / (1/4 + 1/4) = 18.
    fill(half1, 0, 4 * 80, 4);
    fill(half0, 1, 16, 1);  // 1 of one sample and 3 of two: 2^2 / (1 + 1/2) = 8/3.
    fill(half1, 1, 96, 2);
    const std::vector<double> variance = variance_of_blocks(half0, half1);
    REQUIRE(variance.size() == 2);
    CHECK(variance[0] == doctest::Approx(18 * 4 * 3));
    CHECK(variance[1] == doctest::Approx(8.0 / 3 * 2 * 3));
    CHECK(mean_radiance(half0, half1) == doctest::Approx((4 * 3.5 + 2 * (7.0 / 3)) / 6));
}

TEST_CASE("the estimate is the true variance on average, however many samples a half has") {
    // Samples uniform in [0, 1200) quanta: a variance of (1200 / 16)^2 / 12 = 468.75. 3 x 64 x 64 differences have a
    // relative standard error of sqrt(2 / 12288) = 1.3 %; four of them are allowed.
    const BlockGrid grid(64, 64, 64);
    HashRng rng(5);
    for (const std::uint32_t count : {4u, 16u}) {
        FrameSums halves[2] = {{grid, k_quantum}, {grid, k_quantum}};
        for (FrameSums& half : halves) {
            std::vector<PixelSum> sums(64 * 64);
            for (PixelSum& sum : sums)
                for (std::uint32_t i = 0; i < count; ++i)
                    sum += {rng.next_u32() % 1200, rng.next_u32() % 1200, rng.next_u32() % 1200};
            half.add(grid.round(0, 0, count), sums);
        }
        const double per_channel = variance_of_blocks(halves[0], halves[1])[0] / (3 * 64 * 64);
        CHECK(per_channel == doctest::Approx(468.75).epsilon(4 * 0.013));
    }
}

TEST_CASE("sums that lost bits on their way leave the estimate of the variance where it was") {
    // Samples uniform in [0, 1200), of which `shared` keeps 9 bits below the pixel's largest channel: a step of at most 4 and
    // its variance of 4^2 / 12, against one of 1200^2 / 12, is a hundred-thousandth. Correlations of the two are allowed for.
    const BlockGrid grid(64, 64, 64);
    for (const WireFormat format : {WireFormat::half, WireFormat::shared}) {
        HashRng rng(5);
        FrameSums exact[2] = {{grid, k_quantum}, {grid, k_quantum}},
                  rounded[2] = {{grid, k_quantum}, {grid, k_quantum}};
        for (int half = 0; half < 2; ++half) {
            std::vector<PixelSum> sums(64 * 64);
            for (PixelSum& sum : sums)
                sum = {rng.next_u32() % 1200, rng.next_u32() % 1200, rng.next_u32() % 1200};
            exact[half].add(grid.round(0, 0, 1), sums);
            REQUIRE(bool(read_rounded_sums(format, round_sums(format, sums), 1, sums)));
            rounded[half].add(grid.round(0, 0, 1), sums);
        }
        const double before = variance_of_blocks(exact[0], exact[1])[0];
        CHECK(variance_of_blocks(rounded[0], rounded[1])[0] == doctest::Approx(before).epsilon(1e-3));
        CHECK(mean_radiance(rounded[0], rounded[1]) ==
              doctest::Approx(mean_radiance(exact[0], exact[1])).epsilon(1e-3));
    }
}
