#include <set>
#include <string>
#include <thread>

#include "net_testing.hpp"
#include "pathscope/net/context.hpp"
#include "pathscope/net/dealer.hpp"
#include "pathscope/net/router.hpp"

#include "testing.hpp"

using namespace pathscope;
using testing::receive_soon;
using testing::send_once_connected;
using testing::soon;

namespace {

const char* const k_addresses[] = {"tcp://127.0.0.1:*", "inproc://router"};

}  // namespace

TEST_CASE("a router and a dealer exchange messages of every size") {
    for (const char* address : k_addresses) {
        CAPTURE(address);
        const Context context;
        auto router = RouterSocket::bind(context, address);
        REQUIRE(bool(router));
        const std::string id = random_routing_id();
        auto dealer = DealerSocket::connect(context, router->endpoint(), id);
        REQUIRE(bool(dealer));

        // Small ones are copied, large ones change owner: 1,024 bytes is the border.
        for (const std::size_t size : {0, 1, 1023, 1024, 1 << 20}) {
            const Frames sent{"head", std::string(size, 'x'), ""};
            REQUIRE(send_once_connected(*dealer, sent) == SendOutcome::delivered);
            auto request = receive_soon(*router);
            REQUIRE(request.has_value());
            CHECK(request->peer == id);
            CHECK(request->frames == sent);

            REQUIRE(router->send(request->peer, std::move(request->frames)) == SendOutcome::delivered);
            const auto reply = receive_soon(*dealer);
            REQUIRE(reply.has_value());
            CHECK(*reply == sent);
        }
        CHECK_FALSE(router->receive().has_value());
        CHECK_FALSE(dealer->receive().has_value());
    }
}

TEST_CASE("the endpoint tells the port that was free") {
    const Context context;
    const auto first = RouterSocket::bind(context, "tcp://127.0.0.1:*");
    const auto second = RouterSocket::bind(context, "tcp://127.0.0.1:*");
    REQUIRE(bool(first));
    REQUIRE(bool(second));
    CHECK(first->endpoint().starts_with("tcp://127.0.0.1:"));
    CHECK(first->endpoint().back() != '*');
    CHECK(first->endpoint() != second->endpoint());
}

TEST_CASE("a port in use and a bad address are sentences that name the endpoint") {
    const Context context;
    const auto first = RouterSocket::bind(context, "tcp://127.0.0.1:*");
    REQUIRE(bool(first));
    const auto second = RouterSocket::bind(context, first->endpoint());
    REQUIRE_FALSE(bool(second));
    CHECK(second.error().kind == ErrorKind::bad_input);
    CHECK(second.error().message.find(first->endpoint()) != std::string::npos);
    CHECK(second.error().message.find("in use") != std::string::npos);

    for (const char* address :
         {"nonsense", "tcp://127.0.0.1", "gopher://127.0.0.1:70", "tcp://127.0.0.1:99999"}) {
        const auto bad = RouterSocket::bind(context, address);
        REQUIRE_FALSE(bool(bad));
        CHECK(bad.error().message.find(address) != std::string::npos);
        const auto worse = DealerSocket::connect(context, address, "id");
        REQUIRE_FALSE(bool(worse));
        CHECK(worse.error().message.find(address) != std::string::npos);
    }
}

TEST_CASE("an unknown peer is unreachable, and the message stays with the sender") {
    const Context context;
    auto router = RouterSocket::bind(context, "tcp://127.0.0.1:*");
    REQUIRE(bool(router));
    Frames frames{"kept", std::string(5000, 'x')};
    CHECK(router->send("nobody", std::move(frames)) == SendOutcome::unreachable);
    CHECK(frames == Frames{"kept", std::string(5000, 'x')});
}

TEST_CASE("a peer that went away becomes unreachable without any timeout") {
    const Context context;
    auto router = RouterSocket::bind(context, "tcp://127.0.0.1:*");
    REQUIRE(bool(router));
    const std::string id = random_routing_id();
    {
        auto dealer = DealerSocket::connect(context, router->endpoint(), id);
        REQUIRE(bool(dealer));
        REQUIRE(send_once_connected(*dealer, {"hello"}) == SendOutcome::delivered);
        REQUIRE(receive_soon(*router).has_value());
        CHECK(router->send(id, {"welcome"}) == SendOutcome::delivered);
    }
    CHECK(soon(*router, [&] { return router->send(id, {"still there?"}) == SendOutcome::unreachable; }));
}

TEST_CASE("a dealer sends only over a connection that stands") {
    const Context context;
    std::string endpoint;
    {
        const Context other;  // Its end waits until the port is really closed.
        const auto free_port = RouterSocket::bind(other, "tcp://127.0.0.1:*");
        REQUIRE(bool(free_port));
        endpoint = free_port->endpoint();
    }
    SocketOptions options;
    options.reconnect_ms = 1;
    options.reconnect_max_ms = 20;
    auto dealer = DealerSocket::connect(context, endpoint, random_routing_id(), options);
    REQUIRE(bool(dealer));
    Frames frames{"kept"};
    CHECK(dealer->send(std::move(frames)) == SendOutcome::would_block);
    CHECK(frames == Frames{"kept"});

    // The other side starts second. The port was free a moment ago; if it is taken by now, this test says
    // nothing.
    auto router = RouterSocket::bind(context, endpoint);
    if (!router) return;
    CHECK(send_once_connected(*dealer, std::move(frames)) == SendOutcome::delivered);
    CHECK(receive_soon(*router)->frames == Frames{"kept"});
}

TEST_CASE("a peer that does not read is reported as would_block, and nothing is buffered beyond the limits") {
    const Context context;
    SocketOptions options;
    options.send_limit = 10;
    options.receive_limit = 10;
    auto router = RouterSocket::bind(context, "inproc://slow", options);
    REQUIRE(bool(router));
    const std::string id = random_routing_id();
    auto dealer = DealerSocket::connect(context, "inproc://slow", id, options);
    REQUIRE(bool(dealer));
    REQUIRE(send_once_connected(*dealer, {"hello"}) == SendOutcome::delivered);
    REQUIRE(receive_soon(*router).has_value());

    int sent = 0;
    while (sent < 1000 && router->send(id, {"more"}) == SendOutcome::delivered) ++sent;
    CHECK(sent == 20);  // Inproc: the limits of both sides are one queue.
    Frames kept{"kept"};
    CHECK(router->send(id, std::move(kept)) == SendOutcome::would_block);
    CHECK(kept == Frames{"kept"});
    for (int i = 0; i < 20; ++i) CHECK(dealer->receive().has_value());
    CHECK(soon(*router, [&] { return router->send(id, {"again"}) == SendOutcome::delivered; }));
}

TEST_CASE("an oversized frame drops the peer that sent it, not the others and not the program") {
    const Context context;
    SocketOptions small;
    small.max_frame_bytes = 1000;
    auto router = RouterSocket::bind(context, "tcp://127.0.0.1:*", small);
    REQUIRE(bool(router));
    const std::string good_id = random_routing_id(), bad_id = random_routing_id();
    auto good = DealerSocket::connect(context, router->endpoint(), good_id);
    REQUIRE(bool(good));
    SocketOptions once;
    once.reconnect_ms = -1;  // ZeroMQ: do not dial again.
    auto bad = DealerSocket::connect(context, router->endpoint(), bad_id, once);
    REQUIRE(bool(bad));

    REQUIRE(send_once_connected(*bad, {"head", std::string(1000, 'x')}) == SendOutcome::delivered);
    CHECK(receive_soon(*router)->peer == bad_id);
    REQUIRE(bad->send({"head", std::string(1001, 'x')}) == SendOutcome::delivered);
    CHECK(soon(*router, [&] { return router->send(bad_id, {"there?"}) == SendOutcome::unreachable; }));

    REQUIRE(send_once_connected(*good, {"fine"}) == SendOutcome::delivered);
    const auto next = receive_soon(*router);
    REQUIRE(next.has_value());
    CHECK(next->peer == good_id);
    CHECK(next->frames == Frames{"fine"});
}

TEST_CASE("a second peer with a routing id that is taken gets nothing, and takes nothing") {
    const Context context;
    auto router = RouterSocket::bind(context, "tcp://127.0.0.1:*");
    REQUIRE(bool(router));
    const std::string id = random_routing_id();
    auto owner = DealerSocket::connect(context, router->endpoint(), id);
    REQUIRE(bool(owner));
    REQUIRE(send_once_connected(*owner, {"first"}) == SendOutcome::delivered);
    REQUIRE(receive_soon(*router)->frames == Frames{"first"});

    auto impostor = DealerSocket::connect(context, router->endpoint(), id);
    REQUIRE(bool(impostor));
    (void)send_once_connected(*impostor, {"forged"});
    REQUIRE(router->send(id, {"secret"}) == SendOutcome::delivered);
    CHECK(receive_soon(*owner).value() == Frames{"secret"});
    REQUIRE(owner->send({"second"}) == SendOutcome::delivered);
    CHECK(receive_soon(*router)->frames == Frames{"second"});
    CHECK_FALSE(impostor->receive().has_value());
}

TEST_CASE("messages of more frames than any of ours are cut, not kept") {
    const Context context;
    auto router = RouterSocket::bind(context, "inproc://many");
    REQUIRE(bool(router));
    auto dealer = DealerSocket::connect(context, "inproc://many", random_routing_id());
    REQUIRE(bool(dealer));
    REQUIRE(send_once_connected(*dealer, Frames(1000, "x")) == SendOutcome::delivered);
    REQUIRE(dealer->send({"next"}) == SendOutcome::delivered);
    const auto cut = receive_soon(*router);
    REQUIRE(cut.has_value());
    CHECK(cut->frames.size() < 20);
    CHECK(cut->frames.size() > 3);
    CHECK(receive_soon(*router)->frames == Frames{"next"});
}

TEST_CASE("drain stops after as many messages as it was allowed") {
    const Context context;
    auto router = RouterSocket::bind(context, "inproc://drain");
    REQUIRE(bool(router));
    auto dealer = DealerSocket::connect(context, "inproc://drain", random_routing_id());
    REQUIRE(bool(dealer));
    for (int i = 0; i < 10; ++i) REQUIRE(send_once_connected(*dealer, {"x"}) == SendOutcome::delivered);
    (void)wait_readable({router->pollable()}, testing::k_patience);
    int handled = 0;
    const auto count = [&](RoutedMessage&&) { ++handled; };
    CHECK(drain(*router, 4, count) == 4);
    CHECK(drain(*router, 100, count) == 6);
    CHECK(handled == 10);
}

TEST_CASE("a router takes from its peers in turn: a busy one does not starve the rest") {
    const Context context;
    auto router = RouterSocket::bind(context, "inproc://fair");
    REQUIRE(bool(router));
    auto busy = DealerSocket::connect(context, "inproc://fair", "busy");
    auto quiet = DealerSocket::connect(context, "inproc://fair", "quiet");
    for (int i = 0; i < 500; ++i) REQUIRE(send_once_connected(*busy, {"x"}) == SendOutcome::delivered);
    REQUIRE(send_once_connected(*quiet, {"x"}) == SendOutcome::delivered);
    std::set<std::string> heard;
    for (int i = 0; i < 4; ++i) heard.insert(receive_soon(*router)->peer);
    CHECK(heard.contains("quiet"));
}

TEST_CASE("sockets and context may go in any order, and a socket may move to another thread") {
    std::optional<RouterSocket> router;
    {
        const Context context;
        auto bound = RouterSocket::bind(context, "inproc://order");
        REQUIRE(bool(bound));
        router = std::move(*bound);
    }
    std::thread other([moved = std::move(*router)]() mutable { CHECK_FALSE(moved.receive().has_value()); });
    other.join();
}

TEST_CASE("routing ids are fresh, of 16 bytes, and do not begin with zero") {
    std::set<std::string> ids;
    for (int i = 0; i < 2000; ++i) {
        const std::string id = random_routing_id();
        CHECK(id.size() == 16);
        CHECK(id[0] != '\0');
        ids.insert(id);
    }
    CHECK(ids.size() == 2000);
}
