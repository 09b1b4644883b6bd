#pragma once
/// A token bucket: limits a rate, and says by how much it may be exceeded.
///
///     tokens(t) = min(depth, tokens(s) + rate (t - s));  whoever sends n bytes takes n tokens
///     =>  bytes sent in any span of length T  <=  rate T + depth
///
/// Why: a sender that wakes a little late may catch up (that is what the depth is for), and yet no span,
/// however it is laid, sees more than the bound.
/// Convention: depth = what flows in 10 ms, at least one byte; the bucket starts full. A rate of 0 is no
/// limit.
/// Units: bytes, nanoseconds.   Thread safety: none; time comes in as an argument and must not run backwards.
/// Source: Turner 1986, "New directions in communications".   Test: tests/net/test_chaos_stream.cpp

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "pathscope/core/clock.hpp"

namespace pathscope {

class TokenBucket {
  public:
    static constexpr TimeNs k_depth_ns = 10 * k_millisecond_ns;

    [[nodiscard]] static double depth(double bytes_per_second) {
        return std::max(1.0, bytes_per_second * to_seconds(k_depth_ns));
    }

    /// Tokens that are there stay, as far as the new bucket holds them.
    void set_rate(double bytes_per_second, TimeNs now) {
        const bool was_unlimited = rate_ == 0;
        fill(now);
        rate_ = bytes_per_second;
        tokens_ = was_unlimited ? depth(rate_) : std::min(tokens_, depth(rate_));
    }

    /// Whole bytes that may be sent at `now`.
    [[nodiscard]] std::size_t available(TimeNs now) const {
        return rate_ == 0 ? std::numeric_limits<std::size_t>::max() : std::size_t(tokens_at(now));
    }

    /// The earliest time, `now` or later, at which so many bytes may be sent.
    /// Requires: bytes <= depth.
    [[nodiscard]] TimeNs time_of(std::size_t bytes, TimeNs now) const {
        const std::size_t there = available(now);
        if (there >= bytes) return now;
        const double missing = double(bytes) - tokens_at(now);
        return now + std::max<TimeNs>(1, TimeNs(std::ceil(missing / rate_ * double(k_second_ns))));
    }

    /// A share worth waking up for: a quarter of the depth, so that a sleeper who comes late loses nothing.
    [[nodiscard]] std::size_t worthwhile() const {
        return rate_ == 0 ? 1 : std::size_t(std::max(1.0, depth(rate_) / 4));
    }

    /// Requires: bytes <= available(now).
    void take(std::size_t bytes, TimeNs now) {
        fill(now);
        if (rate_ > 0) tokens_ -= double(bytes);
    }

  private:
    double tokens_at(TimeNs now) const {
        return std::min(depth(rate_), tokens_ + rate_ * to_seconds(now - filled_));
    }
    void fill(TimeNs now) {
        if (rate_ > 0) tokens_ = tokens_at(now);
        filled_ = now;
    }

    double rate_ = 0;
    double tokens_ = 0;
    TimeNs filled_ = 0;
};

}  // namespace pathscope
