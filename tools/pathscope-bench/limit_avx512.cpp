#include "pathscope/math/simd_level.hpp"

#if defined(PATHSCOPE_HAS_SIMD_LEVELS)

// All that is shared with other instruction sets comes first.
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"  // GCC 12 warns of its own header (its bug 105593).
#include <immintrin.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "limit_kernels.hpp"
#include "pathscope/math/fused.hpp"
#include "pathscope/math/simd_level.hpp"

#pragma GCC target("avx2,fma,bmi,avx512f,avx512vl")
#define PATHSCOPE_SIMD avx512
#include "limit_kernel.hpp"

namespace pathscope::bench {
const LimitKernel& limit_kernel_avx512() { return avx512::k_limit_kernel; }
}  // namespace pathscope::bench

#endif
