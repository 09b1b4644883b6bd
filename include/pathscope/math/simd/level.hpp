#pragma once
/// Which instructions this translation unit has, and sets of lanes. A part of math/simd.hpp.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "pathscope/math/fused.hpp"
#include "pathscope/math/simd_level.hpp"

#if defined(__SSE4_1__)
#include <immintrin.h>
#endif

#if !defined(PATHSCOPE_SIMD)
#define PATHSCOPE_SIMD portable
#endif
// Numbers for the names of levels, so that the preprocessor can compare them.
#define PATHSCOPE_SIMD_portable 1
#define PATHSCOPE_SIMD_avx2 2
#define PATHSCOPE_SIMD_avx512 3
#define PATHSCOPE_SIMD_JOIN(level) PATHSCOPE_SIMD_##level
#define PATHSCOPE_SIMD_NUMBER(level) PATHSCOPE_SIMD_JOIN(level)
#define PATHSCOPE_SIMD_AT_LEAST(level) (PATHSCOPE_SIMD_NUMBER(PATHSCOPE_SIMD) >= PATHSCOPE_SIMD_##level)

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

/// A set of lanes: bit i is lane i.
using Lanes = std::uint32_t;

[[nodiscard]] inline bool any(Lanes lanes) { return lanes != 0; }
[[nodiscard]] inline int first(Lanes lanes) { return std::countr_zero(lanes); }
[[nodiscard]] inline Lanes without_first(Lanes lanes) { return lanes & (lanes - 1); }

/// Asks for the cache lines of something that will be read soon.
template <class T>
inline void prefetch(const T& what) {
    const char* const begin = reinterpret_cast<const char*>(&what);
    for (std::size_t line = 0; line < sizeof(T); line += 64) __builtin_prefetch(begin + line);
}

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
