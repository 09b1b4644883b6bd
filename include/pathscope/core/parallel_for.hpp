#pragma once
/// parallel_for: the only place that uses OpenMP.
///
///     parallel_for(image.height, threads, [&](int y) { ... });
///
/// Calls body(i) once for each i in [0, count), in no order, on up to `threads` threads (0 = all cores),
/// dynamically in pieces of `grain` items. Returns when all are done; what the bodies wrote is visible to the
/// caller. Requires: body does not throw, and bodies of different i write to different memory. Determinism:
/// results must not depend on which thread runs which i. Thread safety: may be called from several threads at
/// once; each gets its own team. Test: tests/core/test_parallel_for.cpp

#include <cstdint>
#include <functional>

namespace pathscope {

[[nodiscard]] int hardware_threads();

namespace detail {
void parallel_for_range(std::int64_t count, int threads, std::int64_t grain,
                        const std::function<void(std::int64_t begin, std::int64_t end)>& range);
}

template <class Body>
void parallel_for(std::int64_t count, int threads, Body&& body, std::int64_t grain = 1) {
    detail::parallel_for_range(count, threads, grain, [&body](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) body(static_cast<int>(i));
    });
}

}  // namespace pathscope
