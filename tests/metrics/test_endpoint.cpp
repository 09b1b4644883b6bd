// The endpoint's promises that need no HTTP; tests/system/test_metrics.py asks a real run.

#include "pathscope/metrics/endpoint.hpp"

#include <string>

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("a free port is taken and named; one that is in use is refused with a sentence") {
    const EventStore store;
    const auto first = MetricsEndpoint::open("127.0.0.1:0", store);
    REQUIRE(first);
    CHECK((*first)->port() > 0);
    const std::string taken = "127.0.0.1:" + std::to_string((*first)->port());
    const auto second = MetricsEndpoint::open(taken, store);
    REQUIRE(!second);
    CHECK(second.error().message.find(taken) != std::string::npos);
    CHECK(!MetricsEndpoint::open("nonsense", store));
}
