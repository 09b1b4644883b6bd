#pragma once
/// As many floats as one register holds: for loops over pixels, where any number at once gives the same bits. A part of
/// math/simd.hpp.

#include "pathscope/math/fused.hpp"
#include "pathscope/math/simd/float16.hpp"
#include "pathscope/math/simd/float4.hpp"
#include "pathscope/math/simd/float8.hpp"

namespace pathscope {
inline namespace PATHSCOPE_SIMD {

#if PATHSCOPE_SIMD_AT_LEAST(avx512)

using Floats = Float16;

/// At any address.
[[nodiscard]] inline Floats load_floats(const float* many) { return {_mm512_loadu_ps(many)}; }
inline void store_floats(float* many, Floats a) { _mm512_storeu_ps(many, a.lanes); }
[[nodiscard]] inline Floats broadcast_floats(float a) { return broadcast16(a); }
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
