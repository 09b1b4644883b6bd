#include "limit_kernel.hpp"
#include "limit_kernels.hpp"
#include "pathscope/core/check.hpp"

namespace pathscope::bench {

const LimitKernel& limit_kernel_portable() { return portable::k_limit_kernel; }

const LimitKernel& limit_kernel(SimdLevel level) {
    CHECK(level <= highest_simd_level(), name_of(level));
#if defined(PATHSCOPE_HAS_SIMD_LEVELS)
    if (level == SimdLevel::avx512) return limit_kernel_avx512();
    if (level == SimdLevel::avx2) return limit_kernel_avx2();
#endif
    return limit_kernel_portable();
}

}  // namespace pathscope::bench
