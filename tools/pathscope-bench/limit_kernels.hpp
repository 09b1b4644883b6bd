#pragma once
/// The two loops that show what a core can do with one instruction set, and nothing else: arithmetic, and reading.
///
/// Both keep k_chains sums at once, so that none waits for another: an addition takes four cycles, and a core begins two in
/// each. They are plain loops that the compiler makes of vector types (limit_kernel.hpp), not tuned assembly: what
/// other code of this project could at best be.

#include <cstddef>
#include <cstdint>

#include "pathscope/math/simd_level.hpp"

namespace pathscope::bench {

struct LimitKernel {
    std::size_t lanes;  ///< Floats in a register.

    /// x <- a x + b for k_chains registers x, `rounds` times over. Returns something that depends on all of them.
    float (*multiply_add)(std::int64_t rounds, float a, float b);

    /// The sum of the numbers. Requires: count is a multiple of k_read_floats.
    float (*sum)(const float* numbers, std::size_t count);
};

inline constexpr std::size_t k_chains = 12;
inline constexpr std::size_t k_read_floats = 12 * 16;  ///< All chains, of the widest registers.

/// Requires: level <= highest_simd_level().
[[nodiscard]] const LimitKernel& limit_kernel(SimdLevel level);

[[nodiscard]] const LimitKernel& limit_kernel_portable();
[[nodiscard]] const LimitKernel& limit_kernel_avx2();
[[nodiscard]] const LimitKernel& limit_kernel_avx512();

}  // namespace pathscope::bench
