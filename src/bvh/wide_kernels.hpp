#pragma once
/// The walk through the wide tree (wide_kernel.hpp), as compiled for each instruction set.

#include "pathscope/bvh/wide_traverse.hpp"

namespace pathscope {

[[nodiscard]] const WideKernel& wide_kernel_portable();
[[nodiscard]] const WideKernel& wide_kernel_avx2();
[[nodiscard]] const WideKernel& wide_kernel_avx512();

}  // namespace pathscope
