#include "pathscope/net/security.hpp"

#include "net_testing.hpp"
#include "pathscope/net/connection_watch.hpp"
#include "pathscope/net/context.hpp"
#include "pathscope/net/publisher.hpp"
#include "pathscope/net/subscriber.hpp"

#include "testing.hpp"

using namespace pathscope;
using testing::receive_soon;
using testing::send_once_connected;
using testing::soon;

namespace {

SocketOptions with(Security security) {
    SocketOptions options;
    options.security = std::move(security);
    options.reconnect_ms = -1;  // A refused dialler must not try again in these tests.
    return options;
}

}  // namespace

TEST_CASE("keys are made, recognised, and a secret key gives its public one") {
    const KeyPair first = make_key_pair(), second = make_key_pair();
    CHECK(first.secret_key != second.secret_key);
    CHECK(is_key(first.public_key));
    CHECK(is_key(first.secret_key));
    CHECK(key_pair_of(first.secret_key)->public_key == first.public_key);
    for (const std::string& text : {std::string(), std::string("short"), std::string(41, '0'),
                                    std::string(40, '~'), std::string(40, '\0')}) {
        CHECK_FALSE(is_key(text));
        CHECK_FALSE(bool(key_pair_of(text)));
    }
}

TEST_CASE("a dialler on the list gets in") {
    const Context context;
    const KeyPair client = make_key_pair(), server = make_key_pair();
    REQUIRE(bool(admit_only(context, {server.public_key})));
    auto router = RouterSocket::bind(context, "tcp://127.0.0.1:*", with(Listener{client}));
    REQUIRE(bool(router));
    auto dealer =
        DealerSocket::connect(context, router->endpoint(), "d", with(Dialler{server, client.public_key}));
    REQUIRE(bool(dealer));
    REQUIRE(send_once_connected(*dealer, {"hello", std::string(100'000, 'x')}) == SendOutcome::delivered);
    CHECK(receive_soon(*router)->frames == Frames{"hello", std::string(100'000, 'x')});

    auto publisher = PublisherSocket::bind(context, "tcp://127.0.0.1:*", with(Listener{client}));
    auto subscriber = SubscriberSocket::connect(context, publisher->endpoint(), "",
                                                with(Dialler{server, client.public_key}));
    REQUIRE(soon(*publisher, [&] { return publisher->count_subscriptions() == 1; }));
    publisher->publish({"news"});
    CHECK(receive_soon(*subscriber).value() == Frames{"news"});
}

TEST_CASE("who has no key, a key that is not listed, or the wrong idea of the listener is refused") {
    const Context context;
    const KeyPair client = make_key_pair(), server = make_key_pair(), stranger = make_key_pair();
    REQUIRE(bool(admit_only(context, {server.public_key})));
    auto router = RouterSocket::bind(context, "tcp://127.0.0.1:*", with(Listener{client}));
    REQUIRE(bool(router));
    auto watch = ConnectionWatch::watch(context, *router);
    REQUIRE(bool(watch));

    const Security refused[] = {Security{}, Dialler{stranger, client.public_key},
                                Dialler{server, stranger.public_key}};
    for (const Security& security : refused) {
        auto dealer = DealerSocket::connect(context, router->endpoint(), "d", with(security));
        REQUIRE(bool(dealer));
        ConnectionChanges seen;
        CHECK(soon(*watch, [&] {
            const ConnectionChanges changes = watch->take_changes();
            seen.accepted += changes.accepted;
            seen.refused += changes.refused;
            return seen.refused > 0;
        }));
        CHECK(seen.accepted == 0);
        CHECK(dealer->send({"x"}) == SendOutcome::would_block);
    }
    CHECK_FALSE(router->receive().has_value());

    // The door is still open to those who may enter.
    auto dealer =
        DealerSocket::connect(context, router->endpoint(), "d", with(Dialler{server, client.public_key}));
    REQUIRE(send_once_connected(*dealer, {"x"}) == SendOutcome::delivered);
    CHECK(receive_soon(*router)->frames == Frames{"x"});
}

TEST_CASE("a listener without a list of keys does not open, as ZeroMQ would admit everybody") {
    const Context context;
    CHECK_FALSE(bool(RouterSocket::bind(context, "tcp://127.0.0.1:*", with(Listener{make_key_pair()}))));
    REQUIRE(bool(admit_only(context, {})));
    CHECK(bool(RouterSocket::bind(context, "tcp://127.0.0.1:*", with(Listener{make_key_pair()}))));
}

TEST_CASE("a new list replaces the old one for those who come later") {
    const Context context;
    const KeyPair client = make_key_pair(), server = make_key_pair();
    REQUIRE(bool(admit_only(context, {})));
    auto router = RouterSocket::bind(context, "tcp://127.0.0.1:*", with(Listener{client}));
    auto watch = ConnectionWatch::watch(context, *router);
    const SocketOptions options = with(Dialler{server, client.public_key});
    auto early = DealerSocket::connect(context, router->endpoint(), "early", options);
    REQUIRE(soon(*watch, [&] { return watch->take_changes().refused > 0; }));

    REQUIRE(bool(admit_only(context, {server.public_key})));
    auto late = DealerSocket::connect(context, router->endpoint(), "late", options);
    REQUIRE(send_once_connected(*late, {"x"}) == SendOutcome::delivered);
    CHECK(receive_soon(*router)->peer == "late");
}

TEST_CASE("what is no key is a sentence") {
    const auto bad = admit_only(Context(), {"nonsense"});
    REQUIRE_FALSE(bool(bad));
    CHECK(bad.error().message.find("'nonsense' is no public key") != std::string::npos);
}

TEST_CASE("addresses that other machines can reach are known") {
    for (const char* endpoint :
         {"tcp://127.0.0.1:5556", "tcp://127.1.2.3:*", "tcp://localhost:5556", "inproc://x", "ipc:///tmp/x"})
        CHECK_FALSE_MESSAGE(reaches_other_machines(endpoint), endpoint);
    for (const char* endpoint : {"tcp://*:5556", "tcp://0.0.0.0:5556", "tcp://10.0.0.7:5556",
                                 "tcp://eth0:5556", "tcp://example.org:5556"})
        CHECK_MESSAGE(reaches_other_machines(endpoint), endpoint);
}
