#pragma once
/// What the pictures that benchmarks render have in common.

#include <cstdint>

namespace pathscope::bench {

inline constexpr int k_block_size = 32;                   ///< As programs have it by default.
inline constexpr std::uint32_t k_reference_seed = 0x7ef;  ///< Of the picture taken for true: no round has it.

}  // namespace pathscope::bench
