#pragma once
/// Eight floats or doubles at once, four floats, and as many floats as fit: the only header with intrinsics.
///
///     const Float8 t = (load(plane) - broadcast(origin)) * broadcast(inverse);
///     for (Lanes met = at_most(t_near, t_far); any(met); met = without_first(met)) visit(first(met));
///
/// Which instructions stand behind it is decided by the translation unit that includes it, with
///
///     #include <all other headers>
///     #pragma GCC target("avx2,fma,bmi")
///     #define PATHSCOPE_SIMD avx2
///     #include "pathscope/math/simd.hpp"
///     #include "kernel.hpp"
///
/// so one kernel's text is compiled for AVX-512, for AVX2 and for any machine, and the program picks one of them at run
/// time (simd_level). All names lie in an inline namespace of the level, so that the versions never mix; and the other
/// headers come before the pragma, lest a function that all share be compiled for the newest machine.
///
/// Convention: min and max return the second operand where one is NaN; comparisons with NaN are false. Sums and products
/// round as scalar ones do, lane by lane: the bits are the same at every level. So does fused(), which has one rounding at
/// every level, and is slow on a machine whose instructions have two (fused.hpp).
/// Thread safety: pure.   Test: tests/math/test_simd.cpp

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

#if PATHSCOPE_SIMD_AT_LEAST(avx2)

struct Float8 {
    __m256 lanes;
};

/// Requires: aligned to 32 bytes.
[[nodiscard]] inline Float8 load(const float* eight) { return {_mm256_load_ps(eight)}; }
inline void store(float* eight, Float8 a) { _mm256_store_ps(eight, a.lanes); }
[[nodiscard]] inline Float8 broadcast(float a) { return {_mm256_set1_ps(a)}; }

[[nodiscard]] inline Float8 operator+(Float8 a, Float8 b) { return {_mm256_add_ps(a.lanes, b.lanes)}; }
[[nodiscard]] inline Float8 operator-(Float8 a, Float8 b) { return {_mm256_sub_ps(a.lanes, b.lanes)}; }
[[nodiscard]] inline Float8 operator*(Float8 a, Float8 b) { return {_mm256_mul_ps(a.lanes, b.lanes)}; }
[[nodiscard]] inline Float8 operator/(Float8 a, Float8 b) { return {_mm256_div_ps(a.lanes, b.lanes)}; }
[[nodiscard]] inline Float8 min(Float8 a, Float8 b) { return {_mm256_min_ps(a.lanes, b.lanes)}; }
[[nodiscard]] inline Float8 max(Float8 a, Float8 b) { return {_mm256_max_ps(a.lanes, b.lanes)}; }
/// a b + c, rounded once or twice: for estimates with a margin, not for results.
[[nodiscard]] inline Float8 about_multiply_add(Float8 a, Float8 b, Float8 c) {
    return {_mm256_fmadd_ps(a.lanes, b.lanes, c.lanes)};
}
/// The smallest of the eight.
[[nodiscard]] inline float least(Float8 a) {
    __m128 m = _mm_min_ps(_mm256_castps256_ps128(a.lanes), _mm256_extractf128_ps(a.lanes, 1));
    m = _mm_min_ps(m, _mm_movehl_ps(m, m));
    return _mm_cvtss_f32(_mm_min_ss(m, _mm_movehdup_ps(m)));
}
[[nodiscard]] inline float greatest(Float8 a) {
    __m128 m = _mm_max_ps(_mm256_castps256_ps128(a.lanes), _mm256_extractf128_ps(a.lanes, 1));
    m = _mm_max_ps(m, _mm_movehl_ps(m, m));
    return _mm_cvtss_f32(_mm_max_ss(m, _mm_movehdup_ps(m)));
}
/// The lanes where a <= b.
[[nodiscard]] inline Lanes at_most(Float8 a, Float8 b) {
#if PATHSCOPE_SIMD_AT_LEAST(avx512)
    return _mm256_cmp_ps_mask(a.lanes, b.lanes, _CMP_LE_OQ);
#else
    return static_cast<Lanes>(_mm256_movemask_ps(_mm256_cmp_ps(a.lanes, b.lanes, _CMP_LE_OQ)));
#endif
}

// ---- Eight doubles.

#if PATHSCOPE_SIMD_AT_LEAST(avx512)

struct Double8 {
    __m512d lanes;
};
/// Requires: aligned to 64 bytes.
[[nodiscard]] inline Double8 load(const double* eight) { return {_mm512_load_pd(eight)}; }
inline void store(double* eight, Double8 a) { _mm512_store_pd(eight, a.lanes); }
[[nodiscard]] inline Double8 widen(Float8 a) { return {_mm512_cvtps_pd(a.lanes)}; }
[[nodiscard]] inline Float8 narrow(Double8 a) { return {_mm512_cvtpd_ps(a.lanes)}; }
[[nodiscard]] inline Double8 broadcast(double a) { return {_mm512_set1_pd(a)}; }
[[nodiscard]] inline Double8 operator+(Double8 a, Double8 b) { return {_mm512_add_pd(a.lanes, b.lanes)}; }
[[nodiscard]] inline Double8 operator-(Double8 a, Double8 b) { return {_mm512_sub_pd(a.lanes, b.lanes)}; }
[[nodiscard]] inline Double8 operator*(Double8 a, Double8 b) { return {_mm512_mul_pd(a.lanes, b.lanes)}; }
[[nodiscard]] inline Double8 operator/(Double8 a, Double8 b) { return {_mm512_div_pd(a.lanes, b.lanes)}; }
[[nodiscard]] inline Double8 min(Double8 a, Double8 b) { return {_mm512_min_pd(a.lanes, b.lanes)}; }
[[nodiscard]] inline Double8 max(Double8 a, Double8 b) { return {_mm512_max_pd(a.lanes, b.lanes)}; }
[[nodiscard]] inline Lanes at_most(Double8 a, Double8 b) {
    return _mm512_cmp_pd_mask(a.lanes, b.lanes, _CMP_LE_OQ);
}
[[nodiscard]] inline Lanes equal(Double8 a, Double8 b) {
    return _mm512_cmp_pd_mask(a.lanes, b.lanes, _CMP_EQ_OQ);
}
/// a b - c, rounded once.
[[nodiscard]] inline Double8 fused_multiply_subtract(Double8 a, Double8 b, Double8 c) {
    return {_mm512_fmsub_pd(a.lanes, b.lanes, c.lanes)};
}
/// a where the lane is chosen, else b.
[[nodiscard]] inline Float8 select(Lanes chosen, Float8 a, Float8 b) {
    return {_mm256_mask_blend_ps(static_cast<__mmask8>(chosen), b.lanes, a.lanes)};
}
[[nodiscard]] inline Double8 select(Lanes chosen, Double8 a, Double8 b) {
    return {_mm512_mask_blend_pd(static_cast<__mmask8>(chosen), b.lanes, a.lanes)};
}

#else

struct Double8 {
    __m256d low, high;
};
[[nodiscard]] inline Double8 load(const double* eight) {
    return {_mm256_load_pd(eight), _mm256_load_pd(eight + 4)};
}
inline void store(double* eight, Double8 a) {
    _mm256_store_pd(eight, a.low);
    _mm256_store_pd(eight + 4, a.high);
}
[[nodiscard]] inline Double8 widen(Float8 a) {
    return {_mm256_cvtps_pd(_mm256_castps256_ps128(a.lanes)),
            _mm256_cvtps_pd(_mm256_extractf128_ps(a.lanes, 1))};
}
[[nodiscard]] inline Float8 narrow(Double8 a) {
    return {_mm256_set_m128(_mm256_cvtpd_ps(a.high), _mm256_cvtpd_ps(a.low))};
}
[[nodiscard]] inline Double8 broadcast(double a) { return {_mm256_set1_pd(a), _mm256_set1_pd(a)}; }
[[nodiscard]] inline Double8 operator+(Double8 a, Double8 b) {
    return {_mm256_add_pd(a.low, b.low), _mm256_add_pd(a.high, b.high)};
}
[[nodiscard]] inline Double8 operator-(Double8 a, Double8 b) {
    return {_mm256_sub_pd(a.low, b.low), _mm256_sub_pd(a.high, b.high)};
}
[[nodiscard]] inline Double8 operator*(Double8 a, Double8 b) {
    return {_mm256_mul_pd(a.low, b.low), _mm256_mul_pd(a.high, b.high)};
}
[[nodiscard]] inline Double8 operator/(Double8 a, Double8 b) {
    return {_mm256_div_pd(a.low, b.low), _mm256_div_pd(a.high, b.high)};
}
[[nodiscard]] inline Double8 min(Double8 a, Double8 b) {
    return {_mm256_min_pd(a.low, b.low), _mm256_min_pd(a.high, b.high)};
}
[[nodiscard]] inline Double8 max(Double8 a, Double8 b) {
    return {_mm256_max_pd(a.low, b.low), _mm256_max_pd(a.high, b.high)};
}
[[nodiscard]] inline Lanes lanes_of(__m256d low, __m256d high) {
    return static_cast<Lanes>(_mm256_movemask_pd(low) | _mm256_movemask_pd(high) << 4);
}
[[nodiscard]] inline Lanes at_most(Double8 a, Double8 b) {
    return lanes_of(_mm256_cmp_pd(a.low, b.low, _CMP_LE_OQ), _mm256_cmp_pd(a.high, b.high, _CMP_LE_OQ));
}
[[nodiscard]] inline Lanes equal(Double8 a, Double8 b) {
    return lanes_of(_mm256_cmp_pd(a.low, b.low, _CMP_EQ_OQ), _mm256_cmp_pd(a.high, b.high, _CMP_EQ_OQ));
}
[[nodiscard]] inline Double8 fused_multiply_subtract(Double8 a, Double8 b, Double8 c) {
    return {_mm256_fmsub_pd(a.low, b.low, c.low), _mm256_fmsub_pd(a.high, b.high, c.high)};
}
[[nodiscard]] inline Float8 select(Lanes chosen, Float8 a, Float8 b) {
    const __m256i bits = _mm256_set_epi32(128, 64, 32, 16, 8, 4, 2, 1);
    const __m256i mask = _mm256_and_si256(_mm256_set1_epi32(static_cast<int>(chosen)), bits);
    return {_mm256_blendv_ps(b.lanes, a.lanes, _mm256_castsi256_ps(_mm256_cmpeq_epi32(mask, bits)))};
}
[[nodiscard]] inline Double8 select(Lanes chosen, Double8 a, Double8 b) {
    const __m256i bits = _mm256_set_epi64x(8, 4, 2, 1);
    const auto mask = [&](Lanes four) {
        return _mm256_castsi256_pd(
            _mm256_cmpeq_epi64(_mm256_and_si256(_mm256_set1_epi64x(four), bits), bits));
    };
    return {_mm256_blendv_pd(b.low, a.low, mask(chosen & 15)),
            _mm256_blendv_pd(b.high, a.high, mask(chosen >> 4))};
}

#endif

#else

struct Float8 {
    std::array<float, 8> lanes;
};

namespace lanewise {
template <class Step>
[[nodiscard]] inline Float8 each(Float8 a, Float8 b, Step step) {
    Float8 result;
    for (std::size_t i = 0; i < 8; ++i) result.lanes[i] = step(a.lanes[i], b.lanes[i]);
    return result;
}
}  // namespace lanewise

[[nodiscard]] inline Float8 load(const float* eight) {
    Float8 result;
    for (std::size_t i = 0; i < 8; ++i) result.lanes[i] = eight[i];
    return result;
}
inline void store(float* eight, Float8 a) {
    for (std::size_t i = 0; i < 8; ++i) eight[i] = a.lanes[i];
}
[[nodiscard]] inline Float8 broadcast(float a) { return {{a, a, a, a, a, a, a, a}}; }

[[nodiscard]] inline Float8 operator+(Float8 a, Float8 b) {
    return lanewise::each(a, b, [](float x, float y) { return x + y; });
}
[[nodiscard]] inline Float8 operator-(Float8 a, Float8 b) {
    return lanewise::each(a, b, [](float x, float y) { return x - y; });
}
[[nodiscard]] inline Float8 operator*(Float8 a, Float8 b) {
    return lanewise::each(a, b, [](float x, float y) { return x * y; });
}
[[nodiscard]] inline Float8 operator/(Float8 a, Float8 b) {
    return lanewise::each(a, b, [](float x, float y) { return x / y; });
}
[[nodiscard]] inline Float8 min(Float8 a, Float8 b) {
    return lanewise::each(a, b, [](float x, float y) { return x < y ? x : y; });
}
[[nodiscard]] inline Float8 max(Float8 a, Float8 b) {
    return lanewise::each(a, b, [](float x, float y) { return x > y ? x : y; });
}
[[nodiscard]] inline Float8 about_multiply_add(Float8 a, Float8 b, Float8 c) { return a * b + c; }
[[nodiscard]] inline Float8 select(Lanes chosen, Float8 a, Float8 b) {
    Float8 result;
    for (std::size_t i = 0; i < 8; ++i) result.lanes[i] = (chosen >> i & 1) != 0 ? a.lanes[i] : b.lanes[i];
    return result;
}
[[nodiscard]] inline float least(Float8 a) { return *std::min_element(a.lanes.begin(), a.lanes.end()); }
[[nodiscard]] inline float greatest(Float8 a) { return *std::max_element(a.lanes.begin(), a.lanes.end()); }
[[nodiscard]] inline Lanes at_most(Float8 a, Float8 b) {
    Lanes lanes = 0;
    for (std::size_t i = 0; i < 8; ++i) lanes |= Lanes{a.lanes[i] <= b.lanes[i]} << i;
    return lanes;
}

struct Double8 {
    std::array<double, 8> lanes;
};

namespace lanewise {
template <class Step>
[[nodiscard]] inline Double8 each(Double8 a, Double8 b, Step step) {
    Double8 result;
    for (std::size_t i = 0; i < 8; ++i) result.lanes[i] = step(a.lanes[i], b.lanes[i]);
    return result;
}
template <class Test>
[[nodiscard]] inline Lanes which(Double8 a, Double8 b, Test test) {
    Lanes lanes = 0;
    for (std::size_t i = 0; i < 8; ++i) lanes |= Lanes{test(a.lanes[i], b.lanes[i])} << i;
    return lanes;
}
}  // namespace lanewise

[[nodiscard]] inline Double8 load(const double* eight) {
    Double8 result;
    for (std::size_t i = 0; i < 8; ++i) result.lanes[i] = eight[i];
    return result;
}
inline void store(double* eight, Double8 a) {
    for (std::size_t i = 0; i < 8; ++i) eight[i] = a.lanes[i];
}
[[nodiscard]] inline Double8 widen(Float8 a) {
    Double8 result;
    for (std::size_t i = 0; i < 8; ++i) result.lanes[i] = a.lanes[i];
    return result;
}
[[nodiscard]] inline Float8 narrow(Double8 a) {
    Float8 result;
    for (std::size_t i = 0; i < 8; ++i) result.lanes[i] = static_cast<float>(a.lanes[i]);
    return result;
}
[[nodiscard]] inline Double8 broadcast(double a) { return {{a, a, a, a, a, a, a, a}}; }
[[nodiscard]] inline Double8 operator+(Double8 a, Double8 b) {
    return lanewise::each(a, b, [](double x, double y) { return x + y; });
}
[[nodiscard]] inline Double8 operator-(Double8 a, Double8 b) {
    return lanewise::each(a, b, [](double x, double y) { return x - y; });
}
[[nodiscard]] inline Double8 operator*(Double8 a, Double8 b) {
    return lanewise::each(a, b, [](double x, double y) { return x * y; });
}
[[nodiscard]] inline Double8 operator/(Double8 a, Double8 b) {
    return lanewise::each(a, b, [](double x, double y) { return x / y; });
}
[[nodiscard]] inline Double8 min(Double8 a, Double8 b) {
    return lanewise::each(a, b, [](double x, double y) { return x < y ? x : y; });
}
[[nodiscard]] inline Double8 max(Double8 a, Double8 b) {
    return lanewise::each(a, b, [](double x, double y) { return x > y ? x : y; });
}
[[nodiscard]] inline Lanes at_most(Double8 a, Double8 b) {
    return lanewise::which(a, b, [](double x, double y) { return x <= y; });
}
[[nodiscard]] inline Lanes equal(Double8 a, Double8 b) {
    return lanewise::which(a, b, [](double x, double y) { return x == y; });
}
[[nodiscard]] inline Double8 fused_multiply_subtract(Double8 a, Double8 b, Double8 c) {
    Double8 result;
    for (std::size_t i = 0; i < 8; ++i) result.lanes[i] = std::fma(a.lanes[i], b.lanes[i], -c.lanes[i]);
    return result;
}
[[nodiscard]] inline Double8 select(Lanes chosen, Double8 a, Double8 b) {
    Double8 result;
    for (std::size_t i = 0; i < 8; ++i) result.lanes[i] = (chosen >> i & 1) != 0 ? a.lanes[i] : b.lanes[i];
    return result;
}

#endif

// ---- Four floats: a point, with one place to spare.

#if defined(__SSE4_1__)

struct Float4 {
    __m128 lanes;
};

/// Requires: aligned to 16 bytes.
[[nodiscard]] inline Float4 load4(const float* four) { return {_mm_load_ps(four)}; }
inline void store(float* four, Float4 a) { _mm_store_ps(four, a.lanes); }
[[nodiscard]] inline Float4 broadcast4(float a) { return {_mm_set1_ps(a)}; }
[[nodiscard]] inline Float4 operator+(Float4 a, Float4 b) { return {_mm_add_ps(a.lanes, b.lanes)}; }
[[nodiscard]] inline Float4 operator-(Float4 a, Float4 b) { return {_mm_sub_ps(a.lanes, b.lanes)}; }
[[nodiscard]] inline Float4 operator*(Float4 a, Float4 b) { return {_mm_mul_ps(a.lanes, b.lanes)}; }
[[nodiscard]] inline Float4 min(Float4 a, Float4 b) { return {_mm_min_ps(a.lanes, b.lanes)}; }
[[nodiscard]] inline Float4 max(Float4 a, Float4 b) { return {_mm_max_ps(a.lanes, b.lanes)}; }
/// With 0 in the fourth lane.
[[nodiscard]] inline Float4 first_three(Float4 a) { return {_mm_blend_ps(a.lanes, _mm_setzero_ps(), 8)}; }
/// Towards zero. Requires: |a| < 2^31.
[[nodiscard]] inline std::array<std::int32_t, 4> truncate(Float4 a) {
    alignas(16) std::array<std::int32_t, 4> result;
    _mm_store_si128(reinterpret_cast<__m128i*>(result.data()), _mm_cvttps_epi32(a.lanes));
    return result;
}

#else

struct Float4 {
    std::array<float, 4> lanes;
};

namespace lanewise {
template <class Step>
[[nodiscard]] inline Float4 each(Float4 a, Float4 b, Step step) {
    Float4 result;
    for (std::size_t i = 0; i < 4; ++i) result.lanes[i] = step(a.lanes[i], b.lanes[i]);
    return result;
}
}  // namespace lanewise

[[nodiscard]] inline Float4 load4(const float* four) { return {{four[0], four[1], four[2], four[3]}}; }
inline void store(float* four, Float4 a) {
    for (std::size_t i = 0; i < 4; ++i) four[i] = a.lanes[i];
}
[[nodiscard]] inline Float4 broadcast4(float a) { return {{a, a, a, a}}; }
[[nodiscard]] inline Float4 operator+(Float4 a, Float4 b) {
    return lanewise::each(a, b, [](float x, float y) { return x + y; });
}
[[nodiscard]] inline Float4 operator-(Float4 a, Float4 b) {
    return lanewise::each(a, b, [](float x, float y) { return x - y; });
}
[[nodiscard]] inline Float4 operator*(Float4 a, Float4 b) {
    return lanewise::each(a, b, [](float x, float y) { return x * y; });
}
[[nodiscard]] inline Float4 min(Float4 a, Float4 b) {
    return lanewise::each(a, b, [](float x, float y) { return x < y ? x : y; });
}
[[nodiscard]] inline Float4 max(Float4 a, Float4 b) {
    return lanewise::each(a, b, [](float x, float y) { return x > y ? x : y; });
}
[[nodiscard]] inline Float4 first_three(Float4 a) { return {{a.lanes[0], a.lanes[1], a.lanes[2], 0}}; }
[[nodiscard]] inline std::array<std::int32_t, 4> truncate(Float4 a) {
    std::array<std::int32_t, 4> result;
    for (std::size_t i = 0; i < 4; ++i) result[i] = static_cast<std::int32_t>(a.lanes[i]);
    return result;
}

#endif

// ---- Sixteen floats: a number of each ray of a packet.

#if PATHSCOPE_SIMD_AT_LEAST(avx512)

struct Float16 {
    __m512 lanes;
};

/// Requires: aligned to 64 bytes.
[[nodiscard]] inline Float16 load16(const float* sixteen) { return {_mm512_load_ps(sixteen)}; }
inline void store(float* sixteen, Float16 a) { _mm512_store_ps(sixteen, a.lanes); }
[[nodiscard]] inline Float16 broadcast16(float a) { return {_mm512_set1_ps(a)}; }
[[nodiscard]] inline Float16 operator+(Float16 a, Float16 b) { return {_mm512_add_ps(a.lanes, b.lanes)}; }
[[nodiscard]] inline Float16 operator-(Float16 a, Float16 b) { return {_mm512_sub_ps(a.lanes, b.lanes)}; }
[[nodiscard]] inline Float16 operator*(Float16 a, Float16 b) { return {_mm512_mul_ps(a.lanes, b.lanes)}; }
[[nodiscard]] inline Float16 operator/(Float16 a, Float16 b) { return {_mm512_div_ps(a.lanes, b.lanes)}; }
[[nodiscard]] inline Float16 min(Float16 a, Float16 b) { return {_mm512_min_ps(a.lanes, b.lanes)}; }
[[nodiscard]] inline Float16 max(Float16 a, Float16 b) { return {_mm512_max_ps(a.lanes, b.lanes)}; }
[[nodiscard]] inline Lanes at_most(Float16 a, Float16 b) {
    return _mm512_cmp_ps_mask(a.lanes, b.lanes, _CMP_LE_OQ);
}
/// a b + c, rounded once or twice: for estimates with a margin, not for results.
[[nodiscard]] inline Float16 about_multiply_add(Float16 a, Float16 b, Float16 c) {
    return {_mm512_fmadd_ps(a.lanes, b.lanes, c.lanes)};
}
/// a where the lane is chosen, else b.
[[nodiscard]] inline Float16 select(Lanes chosen, Float16 a, Float16 b) {
    return {_mm512_mask_blend_ps(static_cast<__mmask16>(chosen), b.lanes, a.lanes)};
}
[[nodiscard]] inline float least(Float16 a) { return _mm512_reduce_min_ps(a.lanes); }
[[nodiscard]] inline float greatest(Float16 a) { return _mm512_reduce_max_ps(a.lanes); }

#else

struct Float16 {
    Float8 low, high;
};

[[nodiscard]] inline Float16 load16(const float* sixteen) { return {load(sixteen), load(sixteen + 8)}; }
inline void store(float* sixteen, Float16 a) {
    store(sixteen, a.low);
    store(sixteen + 8, a.high);
}
[[nodiscard]] inline Float16 broadcast16(float a) { return {broadcast(a), broadcast(a)}; }
[[nodiscard]] inline Float16 operator+(Float16 a, Float16 b) { return {a.low + b.low, a.high + b.high}; }
[[nodiscard]] inline Float16 operator-(Float16 a, Float16 b) { return {a.low - b.low, a.high - b.high}; }
[[nodiscard]] inline Float16 operator*(Float16 a, Float16 b) { return {a.low * b.low, a.high * b.high}; }
[[nodiscard]] inline Float16 operator/(Float16 a, Float16 b) { return {a.low / b.low, a.high / b.high}; }
[[nodiscard]] inline Float16 min(Float16 a, Float16 b) { return {min(a.low, b.low), min(a.high, b.high)}; }
[[nodiscard]] inline Float16 max(Float16 a, Float16 b) { return {max(a.low, b.low), max(a.high, b.high)}; }
[[nodiscard]] inline Lanes at_most(Float16 a, Float16 b) {
    return at_most(a.low, b.low) | at_most(a.high, b.high) << 8;
}
[[nodiscard]] inline Float16 about_multiply_add(Float16 a, Float16 b, Float16 c) {
    return {about_multiply_add(a.low, b.low, c.low), about_multiply_add(a.high, b.high, c.high)};
}
[[nodiscard]] inline Float16 select(Lanes chosen, Float16 a, Float16 b) {
    return {select(chosen & 0xff, a.low, b.low), select(chosen >> 8, a.high, b.high)};
}
[[nodiscard]] inline float least(Float16 a) { return least(min(a.low, a.high)); }
[[nodiscard]] inline float greatest(Float16 a) { return greatest(max(a.low, a.high)); }

#endif

// ---- As many floats as one register holds: for loops over pixels, where any number at once gives the same bits.

#if PATHSCOPE_SIMD_AT_LEAST(avx512)

using Floats = Float16;

/// At any address.
[[nodiscard]] inline Floats load_floats(const float* many) { return {_mm512_loadu_ps(many)}; }
inline void store_floats(float* many, Floats a) { _mm512_storeu_ps(many, a.lanes); }
[[nodiscard]] inline Floats broadcast_floats(float a) { return broadcast16(a); }
/// a b + c, rounded once (fused.hpp).
[[nodiscard]] inline Floats fused(Floats a, Floats b, Floats c) {
    return {_mm512_fmadd_ps(a.lanes, b.lanes, c.lanes)};
}
/// a 2^n, where n stands in the last bits of `n_below` as a whole number, as it does in 0x1.8p23f + n.
/// Requires: the result is a normal number, or a is 1 and n is -127, which gives 0.
[[nodiscard]] inline Floats times_power_of_two(Floats a, Floats n_below) {
    const __m512i exponent = _mm512_slli_epi32(_mm512_castps_si512(n_below.lanes), 23);
    return {_mm512_castsi512_ps(_mm512_add_epi32(_mm512_castps_si512(a.lanes), exponent))};
}

#elif PATHSCOPE_SIMD_AT_LEAST(avx2)

using Floats = Float8;

[[nodiscard]] inline Floats load_floats(const float* many) { return {_mm256_loadu_ps(many)}; }
inline void store_floats(float* many, Floats a) { _mm256_storeu_ps(many, a.lanes); }
[[nodiscard]] inline Floats broadcast_floats(float a) { return broadcast(a); }
[[nodiscard]] inline Floats fused(Floats a, Floats b, Floats c) {
    return {_mm256_fmadd_ps(a.lanes, b.lanes, c.lanes)};
}
[[nodiscard]] inline Floats times_power_of_two(Floats a, Floats n_below) {
    const __m256i exponent = _mm256_slli_epi32(_mm256_castps_si256(n_below.lanes), 23);
    return {_mm256_castsi256_ps(_mm256_add_epi32(_mm256_castps_si256(a.lanes), exponent))};
}

#elif defined(__SSE4_1__)

using Floats = Float4;

[[nodiscard]] inline Floats load_floats(const float* many) { return {_mm_loadu_ps(many)}; }
inline void store_floats(float* many, Floats a) { _mm_storeu_ps(many, a.lanes); }
[[nodiscard]] inline Floats broadcast_floats(float a) { return broadcast4(a); }
[[nodiscard]] inline Floats times_power_of_two(Floats a, Floats n_below) {
    const __m128i exponent = _mm_slli_epi32(_mm_castps_si128(n_below.lanes), 23);
    return {_mm_castsi128_ps(_mm_add_epi32(_mm_castps_si128(a.lanes), exponent))};
}

#else

using Floats = Float4;

[[nodiscard]] inline Floats load_floats(const float* many) { return load4(many); }
inline void store_floats(float* many, Floats a) { store(many, a); }
[[nodiscard]] inline Floats broadcast_floats(float a) { return broadcast4(a); }
[[nodiscard]] inline Floats times_power_of_two(Floats a, Floats n_below) {
    return lanewise::each(a, n_below, [](float x, float n) {
        return std::bit_cast<float>(std::bit_cast<std::uint32_t>(x) +
                                    (std::bit_cast<std::uint32_t>(n) << 23));
    });
}

#endif

#if !PATHSCOPE_SIMD_AT_LEAST(avx2)

[[nodiscard]] inline Floats fused(Floats a, Floats b, Floats c) {
    std::array<std::array<float, 4>, 3> in;
    store_floats(in[0].data(), a);
    store_floats(in[1].data(), b);
    store_floats(in[2].data(), c);
    std::array<float, 4> out;
    for (std::size_t i = 0; i < 4; ++i) out[i] = fused_multiply_add(in[0][i], in[1][i], in[2][i]);
    return load_floats(out.data());
}

#endif

inline constexpr std::size_t k_floats = sizeof(Floats) / sizeof(float);

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
