#pragma once
/// GetPairs (sampler_batch.hpp), as compiled for each instruction set. With it comes all that is shared with other instruction sets,
/// for the source files that choose one; of sampler.hpp those use nothing but templates of a vector that no other file uses.

#include <array>
#include <cstring>
#include <memory>

#include "pathscope/core/check.hpp"
#include "pathscope/core/enum_names.hpp"
#include "pathscope/math/simd_level.hpp"
#include "pathscope/math/vec.hpp"

namespace pathscope {

struct SamplerBatch;
void get_pairs_avx2(const SamplerBatch& batch, std::uint32_t dimension, float* x, float* y);
void get_pairs_avx512(const SamplerBatch& batch, std::uint32_t dimension, float* x, float* y);

}  // namespace pathscope
