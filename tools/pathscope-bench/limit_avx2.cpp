#include "pathscope/math/simd_level.hpp"

#if defined(PATHSCOPE_HAS_SIMD_LEVELS)

// All that is shared with other instruction sets comes first.
#include <immintrin.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "limit_kernels.hpp"
#include "pathscope/math/fused.hpp"
#include "pathscope/math/simd_level.hpp"

#pragma GCC target("avx2,fma,bmi")
#define PATHSCOPE_SIMD avx2
#include "limit_kernel.hpp"

namespace pathscope::bench {
const LimitKernel& limit_kernel_avx2() { return avx2::k_limit_kernel; }
}  // namespace pathscope::bench

#endif
