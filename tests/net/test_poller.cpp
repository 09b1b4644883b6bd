#include "pathscope/net/poller.hpp"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <thread>
#include <vector>

#include "net_testing.hpp"
#include "pathscope/core/clock.hpp"
#include "pathscope/net/context.hpp"
#include "pathscope/net/dealer.hpp"
#include "pathscope/net/router.hpp"
#include "pathscope/net/wake_pair.hpp"

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("a wait ends with nothing after its time, and not before it") {
    auto wake = WakePair::create();
    REQUIRE(bool(wake));
    const TimeNs start = monotonic_now();
    CHECK(wait_readable({wake->pollable()}, 1'500'000).none());
    CHECK(monotonic_now() - start >= 1'500'000);
    CHECK(wait_readable({wake->pollable()}, 0).none());
}

TEST_CASE("waits of less than a millisecond are no longer than that, if the machine has nothing else to do") {
    const Context context;
    auto socket = RouterSocket::bind(context, "inproc://quiet");
    auto wake = WakePair::create();
    TimeNs shortest = k_second_ns;
    for (int i = 0; i < 1000 && shortest >= 500'000; ++i) {
        const TimeNs start = monotonic_now();
        CHECK(wait_readable({socket->pollable(), wake->pollable()}, 100'000).none());
        shortest = std::min(shortest, monotonic_now() - start);
        CHECK(monotonic_now() - start >= 100'000);
    }
    CHECK(shortest < 500'000);
}

TEST_CASE("what comes during a short wait is seen by it or by the next, be it a message or a ring") {
    const Context context;
    auto router = RouterSocket::bind(context, "inproc://spoken-to");
    auto dealer = DealerSocket::connect(context, "inproc://spoken-to", "d");
    auto wake = WakePair::create();
    CHECK(wait_readable({dealer->sendable()}, 999'999)[0]);
    constexpr int k_messages = 2000;
    std::thread other([&] {
        for (int i = 0; i < k_messages; ++i) {
            while (dealer->send({"x"}) != SendOutcome::delivered) std::this_thread::yield();
            wake->notify();
        }
    });
    int heard = 0, rings = 0;
    // All messages may be heard in one go, before the first ring.
    for (const TimeNs limit = monotonic_now() + testing::k_patience;
         (heard < k_messages || rings == 0) && monotonic_now() < limit;) {
        const Readable ready = wait_readable({router->pollable(), wake->pollable()}, 999'999);
        if (ready[1]) ++rings, wake->clear();
        if (ready[0])
            while (router->receive()) ++heard;
    }
    other.join();
    CHECK(heard == k_messages);
    CHECK(rings > 0);
}

TEST_CASE("a wait tells which of several are ready") {
    const Context context;
    auto quiet = RouterSocket::bind(context, "inproc://quiet");
    auto spoken_to = RouterSocket::bind(context, "inproc://spoken-to");
    auto dealer = DealerSocket::connect(context, "inproc://spoken-to", "d");
    auto wake = WakePair::create();
    REQUIRE(testing::send_once_connected(*dealer, {"x"}) == SendOutcome::delivered);
    const Readable one =
        wait_readable({quiet->pollable(), spoken_to->pollable(), wake->pollable()}, testing::k_patience);
    CHECK_FALSE(one[0]);
    CHECK(one[1]);
    CHECK_FALSE(one[2]);
    wake->notify();
    CHECK(wait_readable({quiet->pollable(), spoken_to->pollable(), wake->pollable()}, -1)[2]);
}

TEST_CASE("rings add up to one, and none is lost between two waits") {
    auto wake = WakePair::create();
    REQUIRE(bool(wake));
    for (int i = 0; i < 100'000; ++i) wake->notify();  // More than a pipe holds: must not block.
    CHECK(wait_readable({wake->pollable()}, -1)[0]);
    wake->clear();
    CHECK(wait_readable({wake->pollable()}, 0).none());
    wake->notify();
    CHECK(wait_readable({wake->pollable()}, -1)[0]);
}

TEST_CASE("many threads ring, one waits: every item is seen") {
    auto wake = WakePair::create();
    REQUIRE(bool(wake));
    constexpr int k_threads = 4, k_items = 5000;
    std::atomic<int> produced{0};
    std::vector<std::thread> threads;
    for (int t = 0; t < k_threads; ++t)
        threads.emplace_back([&] {
            for (int i = 0; i < k_items; ++i) {
                ++produced;
                wake->notify();
            }
        });
    int seen = 0;
    while (seen < k_threads * k_items) {
        if (!wait_readable({wake->pollable()}, testing::k_patience)[0]) break;
        wake->clear();
        seen = produced;
    }
    for (std::thread& thread : threads) thread.join();
    CHECK(seen == k_threads * k_items);
}

TEST_CASE("a signal ends a wait early and is no error; its handler may ring") {
    static WakePair* bell = nullptr;
    auto wake = WakePair::create();
    auto never = WakePair::create();
    REQUIRE(bool(wake));
    REQUIRE(bool(never));
    bell = &*wake;
    struct sigaction action {
    }, before{};
    action.sa_handler = [](int) { bell->notify(); };
    REQUIRE(sigaction(SIGUSR1, &action, &before) == 0);

    const pthread_t waiting = pthread_self();
    std::thread other([&] { pthread_kill(waiting, SIGUSR1); });
    // Whether the signal comes before or during the wait, the ring is heard.
    Readable ready;
    const TimeNs deadline = monotonic_now() + testing::k_patience;
    while (ready.none() && monotonic_now() < deadline)
        ready = wait_readable({never->pollable(), wake->pollable()}, testing::k_patience);
    other.join();
    CHECK(ready[1]);
    sigaction(SIGUSR1, &before, nullptr);
}

TEST_CASE("a dealer is ready to send once its connection stands, not before") {
    const Context context;
    auto dealer = DealerSocket::connect(context, "tcp://127.0.0.1:1", "d");  // Nobody listens on port 1.
    REQUIRE(bool(dealer));
    CHECK(wait_readable({dealer->sendable()}, 20 * k_millisecond_ns).none());
}
