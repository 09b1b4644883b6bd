#pragma once
/// Eight floats. A part of math/simd.hpp.

#include "pathscope/math/simd/level.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

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
[[nodiscard]] inline Float8 magnitude(Float8 a) { return {_mm256_andnot_ps(_mm256_set1_ps(-0.0f), a.lanes)}; }
/// a b + c, rounded once or twice: for estimates with a margin, not for results.
[[nodiscard]] inline Float8 about_multiply_add(Float8 a, Float8 b, Float8 c) {
    return {_mm256_fmadd_ps(a.lanes, b.lanes, c.lanes)};
}
/// a b + c, rounded once (fused.hpp).
[[nodiscard]] inline Float8 fused(Float8 a, Float8 b, Float8 c) {
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

/// Lane j of number i becomes lane i of number j.
[[nodiscard]] inline std::array<Float8, 8> transposed(const std::array<Float8, 8>& rows) {
    std::array<Float8, 8> pairs, fours, columns;
    for (std::size_t i = 0; i < 8; i += 2) {
        pairs[i] = {_mm256_unpacklo_ps(rows[i].lanes, rows[i + 1].lanes)};
        pairs[i + 1] = {_mm256_unpackhi_ps(rows[i].lanes, rows[i + 1].lanes)};
    }
    for (const std::size_t i : {0, 1, 4, 5}) {
        const std::size_t four = i / 4 * 4 + i % 4 * 2;
        fours[four] = {_mm256_shuffle_ps(pairs[i].lanes, pairs[i + 2].lanes, 0x44)};
        fours[four + 1] = {_mm256_shuffle_ps(pairs[i].lanes, pairs[i + 2].lanes, 0xee)};
    }
    for (std::size_t i = 0; i < 4; ++i) {
        columns[i] = {_mm256_permute2f128_ps(fours[i].lanes, fours[i + 4].lanes, 0x20)};
        columns[i + 4] = {_mm256_permute2f128_ps(fours[i].lanes, fours[i + 4].lanes, 0x31)};
    }
    return columns;
}

#if PATHSCOPE_SIMD_AT_LEAST(avx512)
/// a where the lane is chosen, else b.
[[nodiscard]] inline Float8 select(Lanes chosen, Float8 a, Float8 b) {
    return {_mm256_mask_blend_ps(static_cast<__mmask8>(chosen), b.lanes, a.lanes)};
}
#else
[[nodiscard]] inline Float8 select(Lanes chosen, Float8 a, Float8 b) {
    const __m256i bits = _mm256_set_epi32(128, 64, 32, 16, 8, 4, 2, 1);
    const __m256i mask = _mm256_and_si256(_mm256_set1_epi32(static_cast<int>(chosen)), bits);
    return {_mm256_blendv_ps(b.lanes, a.lanes, _mm256_castsi256_ps(_mm256_cmpeq_epi32(mask, bits)))};
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
[[nodiscard]] inline Float8 magnitude(Float8 a) {
    return lanewise::each(a, a, [](float x, float) { return std::abs(x); });
}
[[nodiscard]] inline Float8 about_multiply_add(Float8 a, Float8 b, Float8 c) { return a * b + c; }
[[nodiscard]] inline Float8 fused(Float8 a, Float8 b, Float8 c) {
    Float8 result;
    for (std::size_t i = 0; i < 8; ++i)
        result.lanes[i] = fused_multiply_add(a.lanes[i], b.lanes[i], c.lanes[i]);
    return result;
}
[[nodiscard]] inline Float8 select(Lanes chosen, Float8 a, Float8 b) {
    Float8 result;
    for (std::size_t i = 0; i < 8; ++i) result.lanes[i] = (chosen >> i & 1) != 0 ? a.lanes[i] : b.lanes[i];
    return result;
}
[[nodiscard]] inline std::array<Float8, 8> transposed(const std::array<Float8, 8>& rows) {
    std::array<Float8, 8> columns;
    for (std::size_t i = 0; i < 8; ++i)
        for (std::size_t j = 0; j < 8; ++j) columns[j].lanes[i] = rows[i].lanes[j];
    return columns;
}
[[nodiscard]] inline float least(Float8 a) { return *std::min_element(a.lanes.begin(), a.lanes.end()); }
[[nodiscard]] inline float greatest(Float8 a) { return *std::max_element(a.lanes.begin(), a.lanes.end()); }
[[nodiscard]] inline Lanes at_most(Float8 a, Float8 b) {
    Lanes lanes = 0;
    for (std::size_t i = 0; i < 8; ++i) lanes |= Lanes{a.lanes[i] <= b.lanes[i]} << i;
    return lanes;
}

#endif

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
