#include "pathscope/math/simd_level.hpp"

#if defined(PATHSCOPE_HAS_SIMD_LEVELS)

// All that is shared with other instruction sets comes first; of sampler.hpp nothing is used here but templates of a vector that no
// other file uses.
#include <array>
#include <cstring>
#include <memory>
#include <span>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/math/vec.hpp"

#pragma GCC target("avx2,avx512f,avx512vl")
#include "sampling/pairs_kernel.hpp"
#include "sampling/pairs_kernels.hpp"

namespace pathscope {
void get_pairs_avx512(const SamplerBatch& batch, std::uint32_t dimension, float* x, float* y) {
    get_pairs<SixteenBits>(batch, dimension, x, y);
}
}  // namespace pathscope

#endif
