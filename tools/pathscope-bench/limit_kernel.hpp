#pragma once
/// The loops of limit_kernels.hpp. Included by one source file for each instruction set, after that file has chosen it:
/// limit_portable.cpp, limit_avx2.cpp, limit_avx512.cpp.

#include "limit_kernels.hpp"
#include "pathscope/math/simd.hpp"

namespace pathscope::bench {
inline namespace PATHSCOPE_SIMD {

/// By one instruction where there is one, or by two.
[[nodiscard]] inline Floats times_plus(Floats a, Floats x, Floats b) {
#if PATHSCOPE_SIMD_AT_LEAST(avx2)
    return fused(a, x, b);
#else
    return a * x + b;
#endif
}

[[nodiscard]] inline float sum_of_lanes(const std::array<Floats, k_chains>& chains) {
    Floats total = broadcast_floats(0);
    for (const Floats& chain : chains) total = total + chain;
    std::array<float, k_floats> lanes;
    store_floats(lanes.data(), total);
    float sum = 0;
    for (const float lane : lanes) sum += lane;
    return sum;
}

inline float multiply_add(std::int64_t rounds, float a, float b) {
    std::array<Floats, k_chains> chains;
    for (std::size_t i = 0; i < k_chains; ++i) chains[i] = broadcast_floats(float(i));
    const Floats factor = broadcast_floats(a), term = broadcast_floats(b);
    for (std::int64_t round = 0; round < rounds; ++round)
        for (Floats& x : chains) x = times_plus(factor, x, term);
    return sum_of_lanes(chains);
}

inline float sum(const float* numbers, std::size_t count) {
    std::array<Floats, k_chains> chains;
    chains.fill(broadcast_floats(0));
    for (const float* const end = numbers + count; numbers != end; numbers += k_chains * k_floats)
        for (std::size_t i = 0; i < k_chains; ++i)
            chains[i] = chains[i] + load_floats(numbers + i * k_floats);
    return sum_of_lanes(chains);
}

inline constexpr LimitKernel k_limit_kernel{k_floats, multiply_add, sum};

}  // namespace PATHSCOPE_SIMD
}  // namespace pathscope::bench
