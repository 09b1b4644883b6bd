#pragma once
/// Eight doubles. A part of math/simd.hpp.

#include "pathscope/math/simd/float8.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

#if PATHSCOPE_SIMD_AT_LEAST(avx2)

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

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
