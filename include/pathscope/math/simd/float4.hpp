#pragma once
/// Four floats: a point, with one place to spare. A part of math/simd.hpp.

#include "pathscope/math/simd/level.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

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
[[nodiscard]] inline Float4 magnitude(Float4 a) { return {_mm_andnot_ps(_mm_set1_ps(-0.0f), a.lanes)}; }
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
[[nodiscard]] inline Float4 magnitude(Float4 a) {
    return lanewise::each(a, a, [](float x, float) { return std::abs(x); });
}
[[nodiscard]] inline Float4 first_three(Float4 a) { return {{a.lanes[0], a.lanes[1], a.lanes[2], 0}}; }
[[nodiscard]] inline std::array<std::int32_t, 4> truncate(Float4 a) {
    std::array<std::int32_t, 4> result;
    for (std::size_t i = 0; i < 4; ++i) result[i] = static_cast<std::int32_t>(a.lanes[i]);
    return result;
}

#endif

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
