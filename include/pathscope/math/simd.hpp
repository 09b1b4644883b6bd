#pragma once
/// Eight or sixteen floats at once, four floats, and as many floats as fit: with its parts in math/simd, the only headers
/// with intrinsics.
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

#include "pathscope/math/simd/float16.hpp"
#include "pathscope/math/simd/float4.hpp"
#include "pathscope/math/simd/float8.hpp"
#include "pathscope/math/simd/floats.hpp"
#include "pathscope/math/simd/level.hpp"
