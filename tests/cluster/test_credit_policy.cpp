#include "pathscope/cluster/credit_policy.hpp"

#include <limits>
#include <vector>

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("a server is given what it can render during a round trip, and one more") {
    const TimeNs ms = k_millisecond_ns;
    CHECK(credit_window(std::nullopt, ms) == 2);
    CHECK(credit_window(ms, std::nullopt) == 2);
    CHECK(credit_window(0, ms) == 2);
    CHECK(credit_window(ms / 10, 15 * ms) == 2);
    CHECK(credit_window(15 * ms, 15 * ms) == 2);
    CHECK(credit_window(15 * ms + 1, 15 * ms) == 3);
    CHECK(credit_window(80 * ms, 15 * ms) == 7);  // 80 / 15 = 5.33
    CHECK(credit_window(80 * ms, ms / 10) == k_most_credits);
    CHECK(credit_window(std::numeric_limits<TimeNs>::max(), 0) == k_most_credits);
    CHECK(credit_window(ms, -5) == k_most_credits);
    CHECK(credit_window(-5, ms) == 2);
}

TEST_CASE("a relay is given what it works on side by side, and what comes to it meanwhile") {
    const TimeNs ms = k_millisecond_ns;
    CHECK(credit_window(std::nullopt, std::nullopt, 5) == 6);
    CHECK(credit_window(80 * ms, 15 * ms, 5) == 11);
    CHECK(credit_window(ms / 10, 15 * ms, k_most_credits) == k_most_credits);
    CHECK(credit_window(ms, ms, 1'000'000) == k_most_credits);
}

/// The whole of it in numbers: a server that is idle whenever nothing lies there, over a wire that takes its time.
TEST_CASE("with that window a server never waits for the wire, and with one less it does") {
    for (const TimeNs round_trip : {10, 79, 80, 400}) {
        const auto busy_share = [&](std::size_t window) {
            const TimeNs one = 20, rounds = 500;
            TimeNs done =
                0;  // When the server finished round i: after the one before, and after its lease came.
            std::vector<TimeNs> finished;
            for (TimeNs i = 0; i < rounds; ++i) {
                const bool first_ones = std::size_t(i) < window;
                const TimeNs came =
                    first_ones ? round_trip / 2 : finished[std::size_t(i) - window] + round_trip;
                done = std::max(done, came) + one;
                finished.push_back(done);
            }
            return double(one * rounds) / double(done - round_trip / 2);
        };
        const std::size_t window = credit_window(round_trip, 20);
        CHECK(busy_share(window) == 1);
        if (window > 2) CHECK(busy_share(window - 1) < 0.99);
    }
}

TEST_CASE("the more servers there are, the less of what waits at the client is one's") {
    const std::uint64_t bytes = 32 * 32 * 24;
    CHECK(credit_share(bytes, 1) == k_most_credits);
    CHECK(credit_share(bytes, 21) == k_most_credits);  // 2^25 / 24,576 = 1365, and a 21st of it 65.
    CHECK(credit_share(bytes, 100) == 13);
    CHECK(credit_share(bytes, 1000) == k_least_credits);
    CHECK(credit_share(1024 * 1024 * 24, 1) == k_least_credits);
    CHECK(credit_share(0, 1'000'000) == 33);
}

TEST_CASE("no more leases than results fit into the memory for them, but one in any case") {
    CHECK(most_leases(32 * 32 * 24) == 10'922);  // 2^28 / 24,576
    CHECK(most_leases(1024 * 1024 * 24) == 10);
    CHECK(most_leases(std::numeric_limits<std::uint64_t>::max()) == 1);
    CHECK(most_leases(0) == k_owed_bytes);
}
