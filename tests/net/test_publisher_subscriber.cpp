#include <string>

#include "net_testing.hpp"
#include "pathscope/net/context.hpp"
#include "pathscope/net/publisher.hpp"
#include "pathscope/net/subscriber.hpp"

#include "testing.hpp"

using namespace pathscope;
using testing::receive_soon;
using testing::soon;

TEST_CASE("a subscriber hears everything from the moment its subscription is counted") {
    for (const char* address : {"tcp://127.0.0.1:*", "inproc://news"}) {
        CAPTURE(address);
        const Context context;
        auto publisher = PublisherSocket::bind(context, address);
        REQUIRE(bool(publisher));
        publisher->publish({"PS1", "before anyone listens"});

        auto subscriber = SubscriberSocket::connect(context, publisher->endpoint(), "PS1");
        REQUIRE(bool(subscriber));
        REQUIRE(soon(*publisher, [&] { return publisher->count_subscriptions() == 1; }));

        for (int i = 0; i < 100; ++i) publisher->publish({"PS1", std::to_string(i), std::string(2000, 'x')});
        for (int i = 0; i < 100; ++i) {
            const auto heard = receive_soon(*subscriber);
            REQUIRE(heard.has_value());
            CHECK(*heard == Frames{"PS1", std::to_string(i), std::string(2000, 'x')});
        }
    }
}

TEST_CASE("a subscriber hears only its topic") {
    const Context context;
    auto publisher = PublisherSocket::bind(context, "inproc://topics");
    REQUIRE(bool(publisher));
    auto subscriber = SubscriberSocket::connect(context, "inproc://topics", "PS\x01");
    REQUIRE(bool(subscriber));
    REQUIRE(soon(*publisher, [&] { return publisher->count_subscriptions() == 1; }));
    publisher->publish({"PS\x02\x20", "another version"});
    publisher->publish({"PS\x01\x20", "ours"});
    CHECK(receive_soon(*subscriber).value().at(1) == "ours");
    CHECK_FALSE(subscriber->receive().has_value());
}

TEST_CASE("subscriptions are counted as they come and go") {
    const Context context;
    auto publisher = PublisherSocket::bind(context, "tcp://127.0.0.1:*");
    REQUIRE(bool(publisher));
    CHECK(publisher->count_subscriptions() == 0);
    auto first = SubscriberSocket::connect(context, publisher->endpoint(), "a");
    REQUIRE(soon(*publisher, [&] { return publisher->count_subscriptions() == 1; }));
    {
        auto second = SubscriberSocket::connect(context, publisher->endpoint(), "a");
        REQUIRE(soon(*publisher, [&] { return publisher->count_subscriptions() == 2; }));
    }
    CHECK(soon(*publisher, [&] { return publisher->count_subscriptions() == 1; }));
}

TEST_CASE("a subscriber that does not read loses messages; the publisher neither waits nor grows") {
    const Context context;
    SocketOptions options;
    options.send_limit = 10;
    options.receive_limit = 10;
    auto publisher = PublisherSocket::bind(context, "inproc://flood", options);
    REQUIRE(bool(publisher));
    auto subscriber = SubscriberSocket::connect(context, "inproc://flood", "", options);
    REQUIRE(bool(subscriber));
    REQUIRE(soon(*publisher, [&] { return publisher->count_subscriptions() == 1; }));
    for (int i = 0; i < 1000; ++i) publisher->publish({std::to_string(i)});
    int heard = 0;
    while (subscriber->receive()) ++heard;
    CHECK(heard == 20);
}

TEST_CASE("a port in use is a sentence that names the endpoint") {
    const Context context;
    const auto first = PublisherSocket::bind(context, "tcp://127.0.0.1:*");
    REQUIRE(bool(first));
    const auto second = PublisherSocket::bind(context, first->endpoint());
    REQUIRE_FALSE(bool(second));
    CHECK(second.error().message.find(first->endpoint()) != std::string::npos);
    CHECK_FALSE(bool(SubscriberSocket::connect(context, "nonsense", "")));
}
