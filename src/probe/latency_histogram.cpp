#include "pathscope/probe/latency_histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "pathscope/core/check.hpp"

namespace pathscope {

int LatencyHistogram::bucket_of(TimeNs duration) {
    if (duration < TimeNs{1} << k_lowest_octave) return 0;
    const int octave = std::bit_width(static_cast<std::uint64_t>(duration)) - 1;
    if (octave > k_highest_octave) return k_buckets - 1;
    const auto part = static_cast<int>((duration >> (octave - 4)) - k_parts);
    return (octave - k_lowest_octave) * k_parts + part;
}

TimeNs LatencyHistogram::middle_of(int bucket) {
    const int octave = k_lowest_octave + bucket / k_parts;
    const TimeNs width = TimeNs{1} << (octave - 4);
    return (k_parts + bucket % k_parts) * width + width / 2;
}

void LatencyHistogram::add(TimeNs duration) {
    CHECK(duration >= 0, duration);
    smallest_ = count_ == 0 ? duration : std::min(smallest_, duration);
    largest_ = std::max(largest_, duration);
    ++counts_[static_cast<std::size_t>(bucket_of(duration))];
    ++count_;
    sum_ += duration;
}

std::optional<TimeNs> LatencyHistogram::quantile(double q) const {
    CHECK(q >= 0 && q <= 1, q);
    if (count_ == 0) return std::nullopt;
    const auto rank =
        std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(count_))));
    std::uint64_t seen = 0;
    int bucket = 0;
    while (bucket < k_buckets - 1 && (seen += counts_[static_cast<std::size_t>(bucket)]) < rank) ++bucket;
    return std::clamp(middle_of(bucket), smallest_, largest_);
}

std::optional<TimeNs> LatencyHistogram::mean() const {
    if (count_ == 0) return std::nullopt;
    return sum_ / static_cast<TimeNs>(count_);
}

std::optional<TimeNs> LatencyHistogram::largest() const {
    if (count_ == 0) return std::nullopt;
    return largest_;
}

}  // namespace pathscope
