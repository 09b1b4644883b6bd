#include "sampling/pairs_kernel.hpp"
#include "sampling/pairs_kernels.hpp"

namespace pathscope {

GetPairs get_pairs_kernel(SimdLevel level) {
    CHECK(level <= highest_simd_level(), int(level));
#if defined(PATHSCOPE_HAS_SIMD_LEVELS)
    if (level == SimdLevel::avx512) return get_pairs_avx512;
    if (level == SimdLevel::avx2) return get_pairs_avx2;
#endif
    return get_pairs<FourBits>;
}

}  // namespace pathscope
