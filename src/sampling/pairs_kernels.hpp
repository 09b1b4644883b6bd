#pragma once
/// GetPairs (sampler_batch.hpp), as compiled for each instruction set.

#include "pathscope/sampling/sampler_batch.hpp"

namespace pathscope {

void get_pairs_avx2(const SamplerBatch& batch, std::uint32_t dimension, float* x, float* y);
void get_pairs_avx512(const SamplerBatch& batch, std::uint32_t dimension, float* x, float* y);

}  // namespace pathscope
