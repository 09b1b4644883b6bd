#include "pathscope/cluster/lease_size.hpp"

#include <algorithm>

#include <doctest/doctest.h>

using namespace pathscope;

namespace {
constexpr TimeNs k_ms = k_millisecond_ns;
}

TEST_CASE("a lease holds as many rounds as fit into its time") {
    CHECK(rounds_per_lease(20 * k_ms, 20 * k_ms, 1000, 1) == 1);
    CHECK(rounds_per_lease(20 * k_ms, 5 * k_ms, 1000, 1) == 4);
    CHECK(rounds_per_lease(20 * k_ms, 7 * k_ms, 1000, 1) == 2);
    CHECK(rounds_per_lease(20 * k_ms, k_ms / 10, 1000, 1) == 200);
    CHECK(rounds_per_lease(20 * k_ms, 0, 1u << 30, 1) == 20'000'000);  // Too fast to measure.
}

TEST_CASE("one round is the least, whatever it takes") {
    CHECK(rounds_per_lease(20 * k_ms, 3 * k_second_ns, 1000, 1) == 1);
    CHECK(rounds_per_lease(20 * k_ms, std::nullopt, 1000, 1) == 1);  // Of an unknown server.
    CHECK(rounds_per_lease(20 * k_ms, k_ms, 0, 1) == 1);
    CHECK(rounds_per_lease(0, k_ms, 1000, 1) == 1);  // The user wants single rounds.
}

TEST_CASE("leases shrink with what is left for each place") {
    CHECK(rounds_per_lease(20 * k_ms, k_ms, 400, 10) == 20);
    CHECK(rounds_per_lease(20 * k_ms, k_ms, 399, 10) == 19);
    CHECK(rounds_per_lease(20 * k_ms, k_ms, 100, 10) == 5);
    CHECK(rounds_per_lease(20 * k_ms, k_ms, 19, 10) == 1);
    // Each of ten places takes half of its even share, again and again: an hour's work ends with single rounds.
    std::uint64_t waiting = 100'000, leases = 0;
    std::uint32_t last = ~0u;
    for (; waiting > 0; ++leases) {
        const std::uint32_t rounds = rounds_per_lease(k_second_ns, k_ms, waiting, 10);
        CHECK(rounds <= last);
        last = rounds;
        waiting -= std::min<std::uint64_t>(rounds, waiting);
    }
    CHECK(last == 1);
    CHECK(leases < 100'000 / 100);
}
