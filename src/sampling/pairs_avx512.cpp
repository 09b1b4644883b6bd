#include "sampling/pairs_kernels.hpp"

#if defined(PATHSCOPE_HAS_SIMD_LEVELS)
#pragma GCC target("avx2,avx512f,avx512vl")
#include "sampling/pairs_kernel.hpp"

namespace pathscope {
void get_pairs_avx512(const SamplerBatch& batch, std::uint32_t dimension, float* x, float* y) {
    get_pairs<SixteenBits>(batch, dimension, x, y);
}
}  // namespace pathscope
#endif
