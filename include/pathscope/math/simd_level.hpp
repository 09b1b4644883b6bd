#pragma once
/// Which instructions this machine has, and which of them to use.
///
/// Results do not depend on the level (simd.hpp): it is a matter of speed, so it is a setting of the process and no part of
/// what is rendered. The environment variable PATHSCOPE_SIMD = portable, avx2 or avx512 asks for a lower one than the
/// machine has; a higher one is not granted.
///
/// The faster levels need a compiler that obeys "#pragma GCC target": clang passes over it, so its programs (those of the
/// fuzzers) have the portable level only.
///
/// Thread safety: pure.   Test: tests/math/test_simd.cpp

#include <array>
#include <cstdint>

#include "pathscope/core/enum_names.hpp"

/// Whether this build has the levels above portable.
#if defined(__x86_64__) && !defined(__clang__)
#define PATHSCOPE_HAS_SIMD_LEVELS 1
#endif

namespace pathscope {

enum class SimdLevel : std::uint8_t { portable, avx2, avx512 };
inline constexpr std::array k_simd_level_names{
    EnumName{SimdLevel::portable, "portable"},
    EnumName{SimdLevel::avx2, "avx2"},
    EnumName{SimdLevel::avx512, "avx512"},
};
constexpr const auto& enum_table(SimdLevel) { return k_simd_level_names; }

/// The highest that this machine can run.
[[nodiscard]] SimdLevel highest_simd_level();

/// The one to use: decided at the first call.
[[nodiscard]] SimdLevel simd_level();

}  // namespace pathscope
