#pragma once
/// A token bucket: limits a rate, and says by how much it may be exceeded.
///
///     tokens(t) = min(depth, tokens(s) + rate (t - s));  whoever sends n of something takes n tokens
///     =>  sent in any span of length T  <=  rate T + depth
///
/// Why: who comes a little late may catch up (that is what the depth is for), and yet no span, however it is
/// laid, sees more than the bound.
/// Convention: the bucket starts full. A rate of 0 is no limit.
/// Units: of what is sent (bytes, messages), nanoseconds.
/// No clock: `now` is an argument and never falls.   Thread safety: one thread at a time.
/// Source: Turner 1986, "New directions in communications".   Test: tests/core/test_token_bucket.cpp

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "pathscope/core/clock.hpp"

namespace pathscope {

struct RateLimit {
    double per_second = 0;  ///< 0 = no limit.
    double depth = 1;       ///< At least 1, or nothing is ever allowed.

    [[nodiscard]] bool limits() const { return per_second > 0; }
};

class TokenBucket {
  public:
    TokenBucket() = default;
    TokenBucket(const RateLimit& limit, TimeNs now) : limit_(limit), tokens_(limit.depth), filled_(now) {}

    /// Tokens that are there stay, as far as the new bucket holds them.
    void set_limit(const RateLimit& limit, TimeNs now) {
        const bool was_limited = limit_.limits();
        fill(now);
        limit_ = limit;
        tokens_ = was_limited ? std::min(tokens_, limit.depth) : limit.depth;
    }
    [[nodiscard]] const RateLimit& limit() const { return limit_; }

    /// Whole tokens that there are at `now`.
    [[nodiscard]] std::size_t available(TimeNs now) const {
        return limit_.limits() ? std::size_t(tokens_at(now)) : std::numeric_limits<std::size_t>::max();
    }

    /// The earliest time, `now` or later, at which there are so many. Requires: count <= depth.
    [[nodiscard]] TimeNs time_of(std::size_t count, TimeNs now) const {
        if (available(now) >= count) return now;
        const double missing = double(count) - tokens_at(now);
        return now +
               std::max<TimeNs>(1, TimeNs(std::ceil(missing / limit_.per_second * double(k_second_ns))));
    }

    /// Requires: count <= available(now).
    void take(std::size_t count, TimeNs now) {
        fill(now);
        if (limit_.limits()) tokens_ -= double(count);
    }

    /// Puts some back, as far as the bucket holds them.
    void give(std::size_t count, TimeNs now) {
        fill(now);
        if (limit_.limits()) tokens_ = std::min(limit_.depth, tokens_ + double(count));
    }

    /// Takes one, if there is one.
    bool allow(TimeNs now) {
        if (available(now) == 0) return false;
        take(1, now);
        return true;
    }

  private:
    [[nodiscard]] double tokens_at(TimeNs now) const {
        return std::min(limit_.depth, tokens_ + limit_.per_second * to_seconds(now - filled_));
    }
    void fill(TimeNs now) {
        if (limit_.limits()) tokens_ = tokens_at(now);
        filled_ = now;
    }

    RateLimit limit_;
    double tokens_ = 1;
    TimeNs filled_ = 0;
};

}  // namespace pathscope
