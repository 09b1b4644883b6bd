#include "pathscope/net/poller.hpp"
#include "pathscope/session/worker.hpp"

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("jobs run in order, and their results wake the waiting thread") {
    Result<WakePair> wake = WakePair::create();
    REQUIRE(bool(wake));
    Mailbox<int> mailbox(*wake);
    std::vector<int> seen;
    Worker worker;
    for (int i = 0; i < 100; ++i) worker.post([&mailbox, i] { mailbox.put(i); });
    while (seen.size() < 100) {
        REQUIRE(wait_readable({wake->pollable()}, 10 * k_second_ns)[0]);
        wake->clear();
        for (const int item : mailbox.take_all()) seen.push_back(item);
    }
    for (int i = 0; i < 100; ++i) CHECK(seen[std::size_t(i)] == i);
}
