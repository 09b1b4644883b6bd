#pragma once
/// A distribution of durations in bounded memory: quantiles with a known error, exact count, mean, extremes.
///
///   bucket of t:  octave = floor(log2 t), cut into 16 equal parts   =>   width / t <= 1/16
///   quantile:     the middle of its bucket                          =>   relative error <= 1/32 (3.2 %)
///
/// Why not keep samples: a run has no limit in time, and a reservoir's p95 wobbles from run to run.
/// Units: nanoseconds. Below 1 us and above 68 s everything falls into the outermost bucket; quantiles never
/// leave [smallest, largest]. Thread safety: one thread at a time.
/// See: G. Tene, HdrHistogram (the idea of log-linear buckets).   Test:
/// tests/probe/test_latency_histogram.cpp

#include <array>
#include <cstdint>
#include <optional>

#include "pathscope/core/clock.hpp"

namespace pathscope {

class LatencyHistogram {
  public:
    /// Requires: duration >= 0.
    void add(TimeNs duration);

    [[nodiscard]] std::uint64_t count() const { return count_; }
    [[nodiscard]] TimeNs sum() const { return sum_; }

    /// The value that a fraction q of all are at or below (nearest rank). Nothing while empty.
    /// Requires: 0 <= q <= 1.
    [[nodiscard]] std::optional<TimeNs> quantile(double q) const;

    [[nodiscard]] std::optional<TimeNs> mean() const;
    [[nodiscard]] std::optional<TimeNs> largest() const;

    static constexpr double k_relative_error = 1.0 / 32;

  private:
    static constexpr int k_lowest_octave = 10;   ///< 2^10 ns = 1.02 us
    static constexpr int k_highest_octave = 35;  ///< ends at 2^36 ns = 68.7 s
    static constexpr int k_parts = 16;
    static constexpr int k_buckets = (k_highest_octave - k_lowest_octave + 1) * k_parts;

    [[nodiscard]] static int bucket_of(TimeNs duration);
    [[nodiscard]] static TimeNs middle_of(int bucket);

    std::array<std::uint64_t, k_buckets> counts_{};
    std::uint64_t count_ = 0;
    TimeNs sum_ = 0;
    TimeNs smallest_ = 0;
    TimeNs largest_ = 0;
};

}  // namespace pathscope
