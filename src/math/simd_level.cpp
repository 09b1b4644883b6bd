#include "pathscope/math/simd_level.hpp"

#include <algorithm>
#include <cstdlib>

namespace pathscope {
namespace {

SimdLevel asked_for() {
    const char* name = std::getenv("PATHSCOPE_SIMD");
    return from_name<SimdLevel>(name ? name : "").value_or(SimdLevel::avx512);
}

}  // namespace

SimdLevel highest_simd_level() {
#if defined(PATHSCOPE_HAS_SIMD_LEVELS)
    const bool avx2 =
        __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi");
    if (avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl"))
        return SimdLevel::avx512;
    if (avx2) return SimdLevel::avx2;
#endif
    return SimdLevel::portable;
}

SimdLevel simd_level() {
    static const SimdLevel level = std::min(asked_for(), highest_simd_level());
    return level;
}

}  // namespace pathscope
