#pragma once
/// A token bucket: so many at once, so many a second in the long run.
///
///     tokens(t) = min(burst, tokens(t0) + rate (t - t0)),      one is taken each time; none left: not allowed
///
/// So in any span of T seconds at most burst + rate T are allowed.
/// No clock: `now` is an argument and never falls. Thread safety: one thread at a time.
/// Test: tests/core/test_rate_limit.cpp

#include <algorithm>

#include "pathscope/core/clock.hpp"

namespace pathscope {

struct RateLimit {
    double per_second = 1;
    double burst = 1;  ///< At least 1, or nothing is ever allowed.
};

class TokenBucket {
  public:
    TokenBucket() = default;
    /// Full at first.
    TokenBucket(const RateLimit& limit, TimeNs now) : limit_(limit), tokens_(limit.burst), at_(now) {}

    bool allow(TimeNs now) {
        tokens_ = std::min(limit_.burst, tokens_ + limit_.per_second * to_seconds(now - at_));
        at_ = now;
        if (tokens_ < 1) return false;
        tokens_ -= 1;
        return true;
    }

  private:
    RateLimit limit_;
    double tokens_ = 1;
    TimeNs at_ = 0;
};

}  // namespace pathscope
