#include "pathscope/math/simd_level.hpp"

#if defined(PATHSCOPE_HAS_SIMD_LEVELS)

// All that is shared with other instruction sets comes first.
#include <immintrin.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "filter/tap_kernels.hpp"
#include "pathscope/math/fused.hpp"
#include "pathscope/math/simd_level.hpp"

#pragma GCC target("avx2,fma,bmi")
#define PATHSCOPE_SIMD avx2
#include "filter/tap_kernel.hpp"

namespace pathscope {
const TapKernel& tap_kernel_avx2() { return avx2::k_tap_kernel; }
}  // namespace pathscope

#endif
