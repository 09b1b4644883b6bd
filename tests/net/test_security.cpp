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
    CHECK(std::isalnum(first.public_key[0]) != 0);
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

namespace {

/// Dials until both sides have told that they were refused for the expected reasons. Whoever notices first hangs up, so
/// one of them may see nothing but that now and then. False when anything else is seen, or nothing.
bool both_are_told(const Context& context, RouterSocket& router, const Security& dialler,
                   RefusalReason at_listener, RefusalReason at_dialler) {
    auto listening = ConnectionWatch::watch(context, router);
    bool listener_told = false, dialler_told = false;
    const auto take = [](const ConnectionChanges& changes, RefusalReason expected, bool& told) {
        for (const Refusal& refusal : changes.refusals) {
            told = told || refusal.reason == expected;
            if (refusal.reason != expected && refusal.reason != RefusalReason::broke_off) return false;
        }
        return changes.accepted == 0;
    };
    for (int attempt = 0; attempt < 200 && !(listener_told && dialler_told); ++attempt) {
        auto dialling = DealerSocket::connect_watched(context, router.endpoint(), "d", with(dialler));
        bool refused_here = false, good = true;
        const bool ended = soon(dialling->watch, [&] {
            const ConnectionChanges here = dialling->watch.take_changes();
            refused_here = refused_here || !here.refusals.empty();
            good = good && take(here, at_dialler, dialler_told) &&
                   take(listening->take_changes(), at_listener, listener_told);
            return refused_here || !good;
        });
        if (!ended || !good) return false;
        if (dialling->dealer.send({"x"}) != SendOutcome::would_block) return false;
    }
    return listener_told && dialler_told && !router.receive();
}

}  // namespace

TEST_CASE(
    "who has no key, a key that is not listed, or the wrong idea of the listener is refused, and both are "
    "told why") {
    const Context context;
    const KeyPair client = make_key_pair(), server = make_key_pair(), stranger = make_key_pair();
    REQUIRE(bool(admit_only(context, {server.public_key})));
    auto router = RouterSocket::bind(context, "tcp://127.0.0.1:*", with(Listener{client}));
    REQUIRE(bool(router));
    CHECK(both_are_told(context, *router, {}, RefusalReason::one_sided, RefusalReason::one_sided));
    CHECK(both_are_told(context, *router, Dialler{stranger, client.public_key}, RefusalReason::unlisted_key,
                        RefusalReason::unlisted_key));
    CHECK(both_are_told(context, *router, Dialler{server, stranger.public_key}, RefusalReason::wrong_key,
                        RefusalReason::broke_off));

    const std::vector<RefusedKey> refused = take_refused_keys(context);
    REQUIRE_FALSE(refused.empty());
    CHECK(refused.front().public_key == stranger.public_key);
    CHECK(refused.front().address == "127.0.0.1");

    // The door is still open to those who may enter.
    auto dealer =
        DealerSocket::connect(context, router->endpoint(), "e", with(Dialler{server, client.public_key}));
    REQUIRE(send_once_connected(*dealer, {"x"}) == SendOutcome::delivered);
    const auto received = receive_soon(*router);
    REQUIRE(received.has_value());
    CHECK(received->frames == Frames{"x"});
    CHECK(received->key == server.public_key);
    CHECK(received->address == "127.0.0.1");
}

TEST_CASE("who has keys does not talk to a listener without, and both are told why") {
    const Context context;
    const KeyPair client = make_key_pair(), server = make_key_pair();
    auto router = RouterSocket::bind(context, "tcp://127.0.0.1:*");
    CHECK(both_are_told(context, *router, Dialler{server, client.public_key}, RefusalReason::one_sided,
                        RefusalReason::one_sided));
}

TEST_CASE("who is taken off the list is heard no more, named, and disconnected") {
    const Context context;
    const KeyPair client = make_key_pair(), good = make_key_pair(), bad = make_key_pair();
    REQUIRE(bool(admit_only(context, {good.public_key, bad.public_key})));
    auto router = RouterSocket::bind(context, "tcp://127.0.0.1:*", with(Listener{client}));
    auto stays =
        DealerSocket::connect(context, router->endpoint(), "stays", with(Dialler{good, client.public_key}));
    auto goes =
        DealerSocket::connect(context, router->endpoint(), "goes", with(Dialler{bad, client.public_key}));
    auto own_watch = ConnectionWatch::watch(context, *goes);
    REQUIRE(send_once_connected(*stays, {"1"}) == SendOutcome::delivered);
    REQUIRE(receive_soon(*router)->peer == "stays");
    REQUIRE(send_once_connected(*goes, {"1"}) == SendOutcome::delivered);
    REQUIRE(receive_soon(*router)->peer == "goes");

    auto publisher = PublisherSocket::bind(context, "tcp://127.0.0.1:*", with(Listener{client}));
    auto hears =
        SubscriberSocket::connect(context, publisher->endpoint(), "", with(Dialler{good, client.public_key}));
    auto heard =
        SubscriberSocket::connect(context, publisher->endpoint(), "", with(Dialler{bad, client.public_key}));
    auto subscriber_watch = ConnectionWatch::watch(context, *heard);
    REQUIRE(soon(*publisher, [&] { return publisher->count_subscriptions() == 2; }));

    REQUIRE(bool(admit_only(context, {good.public_key})));
    publisher->disconnect_unlisted();
    CHECK(soon(*subscriber_watch, [&] { return subscriber_watch->take_changes().lost > 0; }));
    publisher->publish({"news"});
    CHECK(receive_soon(*hears).value() == Frames{"news"});
    CHECK_FALSE(heard->receive().has_value());

    CHECK(goes->send({"2"}) == SendOutcome::delivered);
    REQUIRE(stays->send({"2"}) == SendOutcome::delivered);
    std::vector<std::string> revoked;
    CHECK(soon(*router, [&] {
        const auto message = router->receive();
        CHECK((!message || message->peer == "stays"));
        for (std::string& peer : router->take_revoked()) revoked.push_back(std::move(peer));
        return !revoked.empty();
    }));
    CHECK(revoked == std::vector<std::string>{"goes"});
    CHECK(soon(*own_watch, [&] { return own_watch->take_changes().lost > 0; }));
    CHECK(soon(*router, [&] {
        (void)router->receive();
        return router->send("goes", {"?"}) == SendOutcome::unreachable;
    }));
    CHECK(router->send("stays", {"?"}) == SendOutcome::delivered);
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
    REQUIRE(soon(*watch, [&] { return !watch->take_changes().refusals.empty(); }));

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
    for (const char* endpoint : {"tcp://127.0.0.1:5556", "tcp://127.1.2.3:*", "tcp://localhost:5556",
                                 "tcp://[::1]:5556", "inproc://x", "ipc:///tmp/x"})
        CHECK_FALSE_MESSAGE(reaches_other_machines(endpoint), endpoint);
    for (const char* endpoint :
         {"tcp://*:5556", "tcp://0.0.0.0:5556", "tcp://10.0.0.7:5556", "tcp://eth0:5556",
          "tcp://example.org:5556", "tcp://127.example.org:5556", "tcp://[::]:5556", "tcp://128.0.0.1:5556"})
        CHECK_MESSAGE(reaches_other_machines(endpoint), endpoint);
}
