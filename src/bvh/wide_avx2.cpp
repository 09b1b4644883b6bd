#include "pathscope/math/simd_level.hpp"

#if defined(PATHSCOPE_HAS_SIMD_LEVELS)

// All that is shared with other instruction sets comes first.
#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

#include "bvh/wide_kernels.hpp"
#include "pathscope/bvh/box_ray.hpp"
#include "pathscope/bvh/wide_traverse.hpp"
#include "pathscope/geometry/triangle.hpp"
#include "pathscope/math/simd_level.hpp"

#pragma GCC target("avx2,fma,bmi")
#define PATHSCOPE_SIMD avx2
#include "bvh/packet_kernel.hpp"

namespace pathscope {
const WideKernel& wide_kernel_avx2() { return avx2::k_kernel; }
}  // namespace pathscope

#endif
