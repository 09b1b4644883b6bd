/// limits: what one core of this machine can do at most, whatever the program?
///
///   arithmetic   multiplications and additions per second, for each instruction set
///   bandwidth    bytes per second of reading a working set from front to back, over and over
///   latency      nanoseconds of a load whose address the load before it brought, from all over the working set
///
/// Why: a ray's time is bounded from below by each of the three, and a figure says little without the largest of these
/// bounds (tools/performance-page draws that). The memory lies in pages of 2 MiB where the system gives them, as the trees do.
/// On processor time, since the clock on the wall measures other users as well.

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "bench.hpp"
#include "limit_kernels.hpp"
#include "measure.hpp"
#include "pathscope/core/huge_pages.hpp"
#include "pathscope/math/random.hpp"
#include "terminal.hpp"

namespace pathscope::bench {
namespace {

constexpr std::size_t k_smallest_bytes = std::size_t{32} << 10, k_largest_bytes = std::size_t{512} << 20;
constexpr std::int64_t k_rounds = 8'000'000;  ///< Of multiply_add: some tens of milliseconds.
constexpr std::size_t k_least_read = std::size_t{256} << 20;
constexpr std::size_t k_loads = std::size_t{1} << 20;

/// What a loop computes has to be used, or the compiler leaves the loop out.
void use(float result) { CHECK(!std::isnan(result), result); }

double measure_gflops(const LimitKernel& kernel) {
    // |a| < 1, so that x tends to b / (1 - a) and stays a normal number.
    const Cost cost = cost_of([&] { use(kernel.multiply_add(k_rounds, 0.5f, 1)); });
    return 2e-9 * double(k_rounds) * double(k_chains * kernel.lanes) / cost.cpu_s;
}

class Numbers {
  public:
    explicit Numbers(std::size_t bytes)
        : numbers_(bytes / sizeof(float) / k_read_floats * k_read_floats, 1.0f) {}

    [[nodiscard]] double measure_gb_per_s(const LimitKernel& kernel) const {
        const std::size_t bytes = numbers_.size() * sizeof(float), times = k_least_read / bytes + 1;
        const Cost cost = cost_of([&] {
            for (std::size_t i = 0; i < times; ++i) use(kernel.sum(numbers_.data(), numbers_.size()));
        });
        return 1e-9 * double(bytes) * double(times) / cost.cpu_s;
    }

  private:
    HugePageVector<float> numbers_;
};

/// Cache lines, each of which names the next one, in one random circle through all of them.
class Circle {
  public:
    explicit Circle(std::size_t bytes) : lines_(bytes / sizeof(Line)) {
        // Sattolo's shuffle of the identity is a permutation with a single cycle.
        for (std::size_t i = 0; i < lines_.size(); ++i) lines_[i].next = std::uint32_t(i);
        HashRng rng(1);
        for (std::size_t i = lines_.size() - 1; i > 0; --i)
            std::swap(lines_[i].next, lines_[rng.next_u32() % i].next);
    }

    [[nodiscard]] double measure_ns() {
        const Cost cost = cost_of([&] {
            const Line* const lines = lines_.data();
            std::uint32_t place = place_;  // Of its own, lest it be written to memory in each step.
            for (std::size_t i = 0; i < k_loads; ++i) place = lines[place].next;
            place_ = place;
        });
        return 1e9 * cost.cpu_s / double(k_loads);
    }

    /// How many steps until the first line comes again: all lines, if the circle is one.
    [[nodiscard]] std::size_t length() const {
        std::size_t steps = 1;
        for (std::uint32_t line = lines_[0].next; line != 0; line = lines_[line].next) ++steps;
        return steps;
    }
    [[nodiscard]] std::size_t line_count() const { return lines_.size(); }

  private:
    struct alignas(64) Line {
        std::uint32_t next = 0;
    };
    HugePageVector<Line> lines_;
    std::uint32_t place_ = 0;  ///< Where the last round ended: the next one meets other lines.
};

struct Reading {
    double gb_per_s, ns;
};

Reading measure_reading(std::size_t bytes, int runs) {
    const LimitKernel& kernel = limit_kernel(highest_simd_level());
    const Numbers numbers(bytes);
    Circle circle(bytes);
    CHECK(circle.length() == circle.line_count(), circle.length(), circle.line_count());
    const auto measured = interleave<double>(
        runs, {[&] { return numbers.measure_gb_per_s(kernel); }, [&] { return circle.measure_ns(); }});
    return {median(measured[0]), median(measured[1])};
}

std::string size_in_words(std::size_t bytes) {
    return bytes < std::size_t{1} << 20 ? fmt::format("{} KiB", bytes >> 10)
                                        : fmt::format("{} MiB", bytes >> 20);
}

void add_arithmetic(Report& report, TextTable& table, int runs) {
    std::vector<SimdLevel> levels;
    for (const auto& entry : k_simd_level_names)
        if (entry.value <= highest_simd_level()) levels.push_back(entry.value);
    std::vector<std::function<double()>> passes;
    for (const SimdLevel level : levels)
        passes.push_back([level] { return measure_gflops(limit_kernel(level)); });
    const auto rates = interleave(runs, passes);
    for (std::size_t i = 0; i < levels.size(); ++i) {
        const std::string name(name_of(levels[i]));
        const double gflops = median(rates[i]);
        report.rows.push_back({{"limit", "arithmetic"}, {"simd", name}, {"gflops", gflops}});
        table.add({"arithmetic", name, fmt::format("{:.1f} Gflop/s", gflops)});
    }
}

}  // namespace

Result<Report> bench_limits(const BenchOptions& options) {
    Report report;
    report.extra["simd"] = std::string(name_of(simd_level()));
    TextTable table({"limit", "of", "at most"});
    show_progress("limits: arithmetic");
    add_arithmetic(report, table, options.runs);
    for (std::size_t bytes = k_smallest_bytes; bytes <= k_largest_bytes; bytes *= 4) {
        const std::string size = size_in_words(bytes);
        show_progress("limits: " + size);
        const Reading reading = measure_reading(bytes, options.runs);
        report.rows.push_back({{"limit", "bandwidth"}, {"bytes", bytes}, {"gb_per_s", reading.gb_per_s}});
        report.rows.push_back({{"limit", "latency"}, {"bytes", bytes}, {"ns", reading.ns}});
        table.add({"bandwidth", size, fmt::format("{:.1f} GB/s", reading.gb_per_s)});
        table.add({"latency", size, fmt::format("{:.1f} ns", reading.ns)});
    }
    show_progress("");
    table.print();
    return report;
}

}  // namespace pathscope::bench
