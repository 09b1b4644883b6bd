#include "pathscope/render/frame_sums.hpp"

#include <algorithm>
#include <string>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

/// Sums of a made-up round, different for every pixel and round.
std::vector<PixelSum> some_sums(const Round& round) {
    std::vector<PixelSum> sums;
    for (std::uint32_t i = 0; i < std::uint32_t(round.rect.area()); ++i) {
        const std::uint32_t noise = hash_u32(i + 1000 * round.block + 100'000 * round.first);
        sums.push_back({noise, noise / 3, noise % 1000});
    }
    return sums;
}

}  // namespace

TEST_CASE("the mean is sum / count, pixel by pixel, and black where there is no sample") {
    const BlockGrid grid(5, 3, 2);  // The last column and row are narrower.
    FrameSums frame(grid, Quantum{-4});
    const Round round = grid.round(2, 0, 4);  // One pixel wide: x = 4, y = 0 and 1.
    const std::vector<PixelSum> sums{{64, 128, 32}, {4, 0, 1}};
    frame.add(round, sums);

    const Image mean = frame.mean();
    REQUIRE(mean.rect() == PixelRect{0, 0, 5, 3});
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 5; ++x) {
            Rgb expected;
            if (x == 4 && y == 0) expected = {1, 2, 0.5f};
            if (x == 4 && y == 1) expected = {1 / 16.0f, 0, 1 / 64.0f};
            CHECK(mean.at(x, y) == expected);
        }
}

TEST_CASE("rounds may be added in any order") {
    const BlockGrid grid(7, 5, 3);
    std::vector<Round> rounds;
    for (std::uint32_t block = 0; block < grid.count(); ++block) {
        rounds.push_back(grid.round(block, 0, 3));
        rounds.push_back(grid.round(block, 3, 1 + block));
    }
    const auto sum_up = [&] {
        FrameSums frame(grid, Quantum{-20});
        for (const Round& round : rounds) frame.add(round, some_sums(round));
        return frame.mean();
    };
    const Image forwards = sum_up();
    std::ranges::reverse(rounds);
    CHECK(sum_up() == forwards);
    std::ranges::rotate(rounds, rounds.begin() + 5);
    CHECK(sum_up() == forwards);
    rounds.pop_back();
    CHECK(!(sum_up() == forwards));
}

TEST_CASE("samples are counted by block") {
    const BlockGrid grid(5, 3, 2);
    FrameSums frame(grid, Quantum{-4});
    for (const std::uint32_t first : {0u, 4u}) {
        const Round round = grid.round(4, first, first + 4);
        frame.add(round, some_sums(round));
    }
    CHECK(frame.samples_of_block(4) == 12);
    CHECK(frame.samples_of_block(3) == 0);
    const Plane samples = frame.samples();
    for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 5; ++x) CHECK(samples.at(x, y) == (grid.rect(4).contains(x, y) ? 12.0f : 0.0f));
}

TEST_CASE("sums from a file are the same frame, unless they are beyond what their samples can add up to") {
    const BlockGrid grid(5, 3, 2);
    FrameSums frame(grid, Quantum{-4});
    std::vector<std::uint32_t> samples;
    for (std::uint32_t block = 0; block < grid.count(); ++block) {
        frame.add(grid.round(block, 0, 1 + block), some_sums(grid.round(block, 0, 1 + block)));
        samples.push_back(1 + block);
    }
    const std::vector<PixelSum> sums(frame.sums().begin(), frame.sums().end());
    const auto again = FrameSums::restored(grid, Quantum{-4}, sums, samples);
    REQUIRE(bool(again));
    CHECK(again->mean().pixels == frame.mean().pixels);
    CHECK(again->samples().pixels == frame.samples().pixels);

    for (const std::int64_t wrong : {std::int64_t{-1}, k_max_quanta + 1}) {
        std::vector<PixelSum> bad = sums;
        bad[1].g = wrong;  // Of block 0, which has one sample.
        CHECK(FrameSums::restored(grid, Quantum{-4}, bad, samples).error().message.find("(1, 0)") !=
              std::string::npos);
    }
    CHECK(!FrameSums::restored(grid, Quantum{-4}, {}, samples));
}
