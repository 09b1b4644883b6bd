#include "sampling/pairs_kernels.hpp"

#if defined(PATHSCOPE_HAS_SIMD_LEVELS)
#pragma GCC target("avx2")
#include "sampling/pairs_kernel.hpp"

namespace pathscope {
void get_pairs_avx2(const SamplerBatch& batch, std::uint32_t dimension, float* x, float* y) {
    get_pairs<EightBits>(batch, dimension, x, y);
}
}  // namespace pathscope
#endif
