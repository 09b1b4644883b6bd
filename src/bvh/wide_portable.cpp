#include "bvh/packet_kernel.hpp"
#include "bvh/wide_kernels.hpp"

namespace pathscope {

const WideKernel& wide_kernel_portable() { return portable::k_kernel; }

const WideKernel& wide_kernel(SimdLevel level) {
    CHECK(level <= highest_simd_level(), name_of(level));
#if defined(PATHSCOPE_HAS_SIMD_LEVELS)
    if (level == SimdLevel::avx512) return wide_kernel_avx512();
    if (level == SimdLevel::avx2) return wide_kernel_avx2();
#endif
    return wide_kernel_portable();
}

namespace detail {
const WideKernel& k_wide_kernel = wide_kernel(simd_level());
}

}  // namespace pathscope
