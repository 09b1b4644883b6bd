#pragma once
/// The random numbers of many samples at once.
///
///     {x[d][i], y[d][i]}  =  get_2d(first + d)  of the PixelSampler of sample i,   bit by bit
///
/// Why: a path asks for about ten numbers at each vertex, and each is a hundred integer steps. They are the same steps for all
/// samples, so a register does them for as many as it has lanes: compiled for each instruction set, as the trees are
/// (math/simd_level.hpp).
///
/// Units: as sampler.hpp. Thread safety: pure.   Test: tests/sampling/test_sampler_batch.cpp

#include <array>
#include <cstddef>
#include <cstdint>

#include "pathscope/core/check.hpp"
#include "pathscope/math/simd_level.hpp"
#include "pathscope/sampling/sampler.hpp"

namespace pathscope {

inline constexpr std::size_t k_sampler_batch = 256;  ///< Most samples in a batch: a multiple of 16.

/// The seeds of some samples, of one kind.
struct SamplerBatch {
    using Row = std::array<std::uint32_t, k_sampler_batch>;
    SamplerKind kind = SamplerKind::sobol;
    std::size_t size = 0;
    alignas(64) Row pixel_key{}, sample{}, reversed_sample{};

    void clear() { size = 0; }
    /// Requires: of the kind of the others, which are fewer than k_sampler_batch.
    void add(const PixelSampler& sampler) {
        CHECK(size < k_sampler_batch && (size == 0 || kind == sampler.kind()), size);
        const auto seed = sampler.seed();
        kind = sampler.kind();
        pixel_key[size] = seed.pixel_key;
        sample[size] = seed.sample;
        reversed_sample[size] = seed.reversed_sample;
        ++size;
    }
};

/// get_2d() of some dimensions of each sample: x[d][i], y[d][i] belong to dimension d of sample i.
template <std::size_t dimensions>
struct PairRows {
    using Row = std::array<float, k_sampler_batch>;
    alignas(64) std::array<Row, dimensions> x, y;
};

/// x[i], y[i] = get_2d(dimension) of sample i; places up to the next multiple of 16 are written as well.
using GetPairs = void (*)(const SamplerBatch& batch, std::uint32_t dimension, float* x, float* y);

/// As compiled for a level. Requires: level <= highest_simd_level().
[[nodiscard]] GetPairs get_pairs_kernel(SimdLevel level);

/// The dimensions first, first + 1, ... of all samples.
template <std::size_t dimensions>
void get_2d(const SamplerBatch& batch, std::uint32_t first, PairRows<dimensions>& pairs) {
    static const GetPairs get_pairs = get_pairs_kernel(simd_level());
    for (std::size_t d = 0; d < dimensions; ++d)
        get_pairs(batch, first + std::uint32_t(d), pairs.x[d].data(), pairs.y[d].data());
}

}  // namespace pathscope
