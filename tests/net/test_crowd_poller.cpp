#include "pathscope/net/crowd_poller.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "net_testing.hpp"
#include "pathscope/net/context.hpp"
#include "pathscope/net/dealer.hpp"
#include "pathscope/net/descriptor_limit.hpp"
#include "pathscope/net/router.hpp"
#include "pathscope/net/wake_pair.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

using Keys = std::vector<std::uint64_t>;

/// Receives by the poller's rule until a message is there. Empty when patience ends.
Frames next_message(CrowdPoller& poller, DealerSocket& socket, std::uint64_t key) {
    for (const TimeNs limit = monotonic_now() + testing::k_patience; monotonic_now() < limit;) {
        if (auto frames = socket.receive()) return *frames;
        const Keys& stirred = poller.wait(testing::k_patience);
        CHECK(std::all_of(stirred.begin(), stirred.end(), [&](std::uint64_t one) { return one == key; }));
    }
    return {};
}

}  // namespace

TEST_CASE("who waits for a crowd hears nothing of those that are quiet, and not before its time") {
    auto poller = CrowdPoller::create();
    auto wake = WakePair::create();
    REQUIRE(bool(poller));
    poller->add(wake->pollable(), 7);
    const TimeNs start = monotonic_now();
    CHECK(poller->wait(1'500'000).empty());
    CHECK(monotonic_now() - start >= 1'500'000);
    wake->notify();
    CHECK(poller->wait(testing::k_patience) == Keys{7});
    CHECK(poller->wait(0) == Keys{7});  // Until it is cleared.
    wake->clear();
    CHECK(poller->wait(0).empty());
    wake->notify();
    poller->remove(wake->pollable());
    CHECK(poller->wait(0).empty());
}

TEST_CASE("of many dealers the poller names the one that is spoken to, for each message that it is sent") {
    const Context context;
    auto router = RouterSocket::bind(context, "inproc://crowd");
    auto poller = CrowdPoller::create();
    std::vector<DealerSocket> dealers;
    for (std::uint64_t i = 0; i < 20; ++i) {
        dealers.push_back(*DealerSocket::connect(context, "inproc://crowd", "dealer" + std::to_string(i)));
        poller->add(dealers.back().pollable(), i);
    }
    for (DealerSocket& dealer : dealers) {
        REQUIRE(testing::send_once_connected(dealer, {"here"}) == SendOutcome::delivered);
        CHECK_FALSE(dealer.receive());  // The rule: after a send, until nothing is left.
    }
    for (std::size_t i = 0; i < dealers.size(); ++i)
        while (!router->receive()) {
        }
    for (DealerSocket& dealer : dealers) CHECK_FALSE(dealer.receive());
    for (int round = 0; round < 100; ++round) {
        const auto who = std::size_t(round * 7 % 20);
        REQUIRE(router->send("dealer" + std::to_string(who), {std::to_string(round)}) ==
                SendOutcome::delivered);
        CHECK(next_message(*poller, dealers[who], who) == Frames{std::to_string(round)});
        CHECK_FALSE(dealers[who].receive());
    }
    for (DealerSocket& dealer : dealers) poller->remove(dealer.pollable());
}

TEST_CASE("the limit of open files is raised as far as it may be, and never lowered") {
    const std::size_t before = raise_descriptor_limit(0);
    CHECK(before > 0);
    CHECK(raise_descriptor_limit(before) == before);
    CHECK(raise_descriptor_limit(1) == before);
    CHECK(raise_descriptor_limit(before + 1) >= before);
}
