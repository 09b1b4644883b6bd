#include "trace_rate.hpp"

#include <fmt/format.h>
#include <sched.h>
#include <time.h>

#include <atomic>
#include <numeric>
#include <thread>

namespace pathscope::bench {
namespace {

void pin_this_thread(int processor) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(processor, &set);
    CHECK(sched_setaffinity(0, sizeof set, &set) == 0, processor);
}

double thread_cpu_seconds() {
    timespec now{};
    CHECK(clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now) == 0);
    return double(now.tv_sec) + double(now.tv_nsec) * 1e-9;
}

}  // namespace

Result<std::vector<int>> choose_processors(int threads) {
    cpu_set_t allowed;
    CHECK(sched_getaffinity(0, sizeof allowed, &allowed) == 0);
    std::vector<int> processors;
    for (int processor = CPU_SETSIZE - 1; processor >= 0 && int(processors.size()) < threads; --processor)
        if (CPU_ISSET(processor, &allowed)) processors.push_back(processor);
    if (int(processors.size()) < threads)
        return bad_input(fmt::format("--threads {}: this process may use {} processors only.", threads,
                                     processors.size()));
    return processors;
}

double trace_rate(const TraceCall& call, std::span<const Ray> rays, std::span<Answer> answers,
                  std::span<const int> processors) {
    std::atomic<std::size_t> next{0};
    std::vector<double> rates(processors.size());
    const auto work = [&](std::size_t worker) {
        pin_this_thread(processors[worker]);
        std::size_t traced = 0;
        const double begin = thread_cpu_seconds();
        for (std::size_t first; (first = next.fetch_add(k_batch_rays)) < rays.size();) {
            const std::size_t count = std::min(k_batch_rays, rays.size() - first);
            call.trace(rays.subspan(first, count), answers.subspan(first, count));
            traced += count;
        }
        if (traced > 0) rates[worker] = double(traced) * 1e-6 / (thread_cpu_seconds() - begin);
    };
    std::vector<std::thread> workers;
    for (std::size_t worker = 0; worker < processors.size(); ++worker) workers.emplace_back(work, worker);
    for (std::thread& worker : workers) worker.join();
    return std::accumulate(rates.begin(), rates.end(), 0.0);
}

}  // namespace pathscope::bench
