#include "pathscope/core/parallel_for.hpp"

#include <omp.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

/// The state of one loop. Threads take the next piece from `next` until none is left. The two flags say in
/// C++ what OpenMP's fork and join guarantee anyway: ThreadSanitizer does not see into libgomp, but it sees
/// these.
struct Loop {
    const std::function<void(std::int64_t, std::int64_t)>& range;
    std::int64_t count;
    std::int64_t grain;
    std::atomic<bool> forked{false};
    std::atomic<int> joined{0};
    std::atomic<std::int64_t> next{0};
};

void work(Loop& loop) {
    loop.forked.load(std::memory_order_acquire);
    for (;;) {
        const std::int64_t begin = loop.next.fetch_add(loop.grain, std::memory_order_relaxed);
        if (begin >= loop.count) break;
        loop.range(begin, std::min(begin + loop.grain, loop.count));
    }
    loop.joined.fetch_add(1, std::memory_order_release);
}

/// Alone, and not instrumented: the compiler passes &loop to the team through memory of its own, which
/// ThreadSanitizer would take for a race. What loop holds is guarded by its flags.
[[gnu::noinline, gnu::no_sanitize_thread]] void work_in_team(Loop& loop, int team) {
#pragma omp parallel num_threads(team)
    work(loop);
}

}  // namespace

int hardware_threads() { return std::max(1u, std::thread::hardware_concurrency()); }

namespace detail {

void parallel_for_range(std::int64_t count, int threads, std::int64_t grain,
                        const std::function<void(std::int64_t, std::int64_t)>& range) {
    CHECK(count >= 0 && threads >= 0 && grain >= 1, count, threads, grain);
    if (threads == 0) threads = hardware_threads();
    const std::int64_t pieces = (count + grain - 1) / grain;
    const int team = static_cast<int>(std::min<std::int64_t>(threads, pieces));
    if (team <= 1) {
        if (count > 0) range(0, count);
        return;
    }
    Loop loop{range, count, grain};
    loop.forked.store(true, std::memory_order_release);
    work_in_team(loop, team);
    loop.joined.load(std::memory_order_acquire);
}

}  // namespace detail
}  // namespace pathscope
