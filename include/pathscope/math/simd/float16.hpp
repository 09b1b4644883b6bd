#pragma once
/// Sixteen floats: a number of each ray of a packet. A part of math/simd.hpp.

#include "pathscope/math/simd/float8.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

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
[[nodiscard]] inline Float16 magnitude(Float16 a) { return {_mm512_abs_ps(a.lanes)}; }
[[nodiscard]] inline Lanes at_most(Float16 a, Float16 b) {
    return _mm512_cmp_ps_mask(a.lanes, b.lanes, _CMP_LE_OQ);
}
/// a b + c, rounded once or twice: for estimates with a margin, not for results.
[[nodiscard]] inline Float16 about_multiply_add(Float16 a, Float16 b, Float16 c) {
    return {_mm512_fmadd_ps(a.lanes, b.lanes, c.lanes)};
}
/// a b + c, rounded once (fused.hpp).
[[nodiscard]] inline Float16 fused(Float16 a, Float16 b, Float16 c) {
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
[[nodiscard]] inline Float16 magnitude(Float16 a) { return {magnitude(a.low), magnitude(a.high)}; }
[[nodiscard]] inline Lanes at_most(Float16 a, Float16 b) {
    return at_most(a.low, b.low) | at_most(a.high, b.high) << 8;
}
[[nodiscard]] inline Float16 about_multiply_add(Float16 a, Float16 b, Float16 c) {
    return {about_multiply_add(a.low, b.low, c.low), about_multiply_add(a.high, b.high, c.high)};
}
[[nodiscard]] inline Float16 fused(Float16 a, Float16 b, Float16 c) {
    return {fused(a.low, b.low, c.low), fused(a.high, b.high, c.high)};
}
[[nodiscard]] inline Float16 select(Lanes chosen, Float16 a, Float16 b) {
    return {select(chosen & 0xff, a.low, b.low), select(chosen >> 8, a.high, b.high)};
}
[[nodiscard]] inline float least(Float16 a) { return least(min(a.low, a.high)); }
[[nodiscard]] inline float greatest(Float16 a) { return greatest(max(a.low, a.high)); }

#endif

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope
