#include "filter/tap_kernel.hpp"
#include "filter/tap_kernels.hpp"
#include "pathscope/core/check.hpp"

namespace pathscope {

const TapKernel& tap_kernel_portable() { return portable::k_tap_kernel; }

const TapKernel& tap_kernel(SimdLevel level) {
    CHECK(level <= highest_simd_level(), name_of(level));
#if defined(PATHSCOPE_HAS_SIMD_LEVELS)
    if (level == SimdLevel::avx512) return tap_kernel_avx512();
    if (level == SimdLevel::avx2) return tap_kernel_avx2();
#endif
    return tap_kernel_portable();
}

}  // namespace pathscope
