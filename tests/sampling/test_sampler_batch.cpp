#include "pathscope/sampling/sampler_batch.hpp"

#include <vector>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

TEST_CASE(
    "the numbers of many samples are those of each sample, bit by bit, with every set of instructions") {
    HashRng rng(1);
    for (const auto& [kind, kind_name] : k_sampler_names)
        for (const auto& [level, level_name] : k_simd_level_names) {
            if (level > highest_simd_level()) continue;
            CAPTURE(level_name);
            const GetPairs get_pairs = get_pairs_kernel(level);
            for (const std::size_t count : {1, 4, 5, 15, 16, 17, 100, 255, 256}) {
                SamplerBatch batch;
                std::vector<PixelSampler> samplers;
                for (std::size_t i = 0; i < count; ++i) {
                    const auto at = [&] { return int(rng.next_u32() % 5000); };
                    samplers.emplace_back(kind, rng.next_u32(), at(), at(), rng.next_u32());
                    batch.add(samplers.back());
                }
                PairRows<1> rows;
                for (const std::uint32_t dimension : {0u, 1u, 77u, 0xffffffffu}) {
                    get_pairs(batch, dimension, rows.x[0].data(), rows.y[0].data());
                    for (std::size_t i = 0; i < count; ++i) {
                        REQUIRE(rows.x[0][i] == samplers[i].get_2d(dimension).x);
                        REQUIRE(rows.y[0][i] == samplers[i].get_2d(dimension).y);
                    }
                }
            }
        }
}
