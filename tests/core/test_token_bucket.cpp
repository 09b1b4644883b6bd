#include "pathscope/core/token_bucket.hpp"

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("a token bucket allows a burst, then its rate, and never saves up more than the burst") {
    TimeNs now = 5 * k_second_ns;
    TokenBucket bucket({10, 3}, now);
    const auto allowed_of = [&](int attempts) {
        int allowed = 0;
        for (int i = 0; i < attempts; ++i) allowed += bucket.allow(now);
        return allowed;
    };
    CHECK(allowed_of(100) == 3);
    now += 99 * k_millisecond_ns;
    CHECK(allowed_of(100) == 0);
    now += 2 * k_millisecond_ns;
    CHECK(allowed_of(100) == 1);
    now += 3600 * k_second_ns;
    CHECK(allowed_of(100) == 3);
    int allowed = 0;  // In any ten seconds: burst + 10 rate.
    for (int ms = 0; ms < 10'000; ++ms, now += k_millisecond_ns) allowed += bucket.allow(now);
    CHECK(allowed >= 99);
    CHECK(allowed <= 100);
}

TEST_CASE("a bucket names the time at which there will be enough, and no limit is none") {
    TokenBucket bucket({1000, 10}, 0);
    CHECK(bucket.available(0) == 10);
    bucket.take(10, 0);
    CHECK(bucket.available(0) == 0);
    CHECK(bucket.time_of(5, 0) == 5 * k_millisecond_ns);
    CHECK(bucket.available(5 * k_millisecond_ns - 1) == 4);
    CHECK(bucket.available(5 * k_millisecond_ns) == 5);
    bucket.set_limit({1000, 2}, 5 * k_millisecond_ns);  // What does not fit is gone.
    CHECK(bucket.available(5 * k_millisecond_ns) == 2);

    TokenBucket open;
    CHECK(open.available(0) > 1'000'000);
    open.take(1'000'000, 0);
    CHECK(open.time_of(1'000'000, 0) == 0);
}
