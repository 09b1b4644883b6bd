#pragma once
/// How many rays a second does a call answer?
///
///   rate = sum over threads of (rays of the thread / CPU seconds of the thread)
///
/// Why CPU time: on a machine with other users, the wall clock measures them as well. Threads are pinned, each to a
/// processor of its own, and take batches of k_batch_rays off a common counter, so that none waits for another at the end.

#include <span>
#include <vector>

#include "pathscope/core/result.hpp"
#include "tracer.hpp"

namespace pathscope::bench {

/// So many of the processors that this process may use; the last ones, as the first tends to serve interrupts.
/// Refuses more than there are.
[[nodiscard]] Result<std::vector<int>> choose_processors(int threads);

/// Millions of rays per second, on one thread for each of `processors`. Requires: rays, and as many answers.
[[nodiscard]] double trace_rate(const TraceCall& call, std::span<const Ray> rays, std::span<Answer> answers,
                                std::span<const int> processors);

}  // namespace pathscope::bench
