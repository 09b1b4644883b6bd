#include "pathscope/net/connection_watch.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "net_testing.hpp"
#include "pathscope/net/context.hpp"

#include "testing.hpp"

using namespace pathscope;
using testing::soon;

namespace {

/// Sends bytes that are no ZeroMQ to a tcp:// endpoint on this machine.
void send_garbage(const std::string& endpoint, const std::string& bytes) {
    const int port = std::stoi(endpoint.substr(endpoint.rfind(':') + 1));
    const int line = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(::connect(line, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
    if (!bytes.empty())
        REQUIRE(::send(line, bytes.data(), bytes.size(), MSG_NOSIGNAL) == ssize_t(bytes.size()));
    ::close(line);
}

}  // namespace

TEST_CASE("connections are counted as they come and go, and the lost one is then unreachable") {
    const Context context;
    auto router = RouterSocket::bind(context, "tcp://127.0.0.1:*");
    REQUIRE(bool(router));
    auto watch = ConnectionWatch::watch(context, *router);
    REQUIRE(bool(watch));
    ConnectionChanges seen;
    const auto take = [&] {
        const ConnectionChanges changes = watch->take_changes();
        seen.accepted += changes.accepted;
        seen.lost += changes.lost;
        seen.refusals.insert(seen.refusals.end(), changes.refusals.begin(), changes.refusals.end());
    };

    auto stays = DealerSocket::connect(context, router->endpoint(), "stays");
    REQUIRE(testing::send_once_connected(*stays, {"x"}) == SendOutcome::delivered);
    REQUIRE(testing::receive_soon(*router).has_value());
    {
        auto goes = DealerSocket::connect(context, router->endpoint(), "goes");
        REQUIRE(testing::send_once_connected(*goes, {"x"}) == SendOutcome::delivered);
        REQUIRE(testing::receive_soon(*router).has_value());
        CHECK(soon(*watch, [&] { return take(), seen.accepted == 2; }));
        CHECK(seen.lost == 0);
    }
    CHECK(soon(*watch, [&] { return take(), seen.lost == 1; }));
    CHECK(soon(*router, [&] { return router->send("goes", {"?"}) == SendOutcome::unreachable; }));
    CHECK(router->send("stays", {"?"}) == SendOutcome::delivered);
    CHECK(seen == ConnectionChanges{2, 1, {}});
}

TEST_CASE("who connects and says nothing of ours is counted as refused") {
    const Context context;
    const KeyPair keys = make_key_pair();
    REQUIRE(bool(admit_only(context, {keys.public_key})));
    SocketOptions with_keys, quick;
    with_keys.security = Listener{keys};
    quick.handshake_ms = 100;
    struct Case {
        SocketOptions options;
        const char* bytes;
        RefusalReason reason;
    };
    for (const Case& c :
         {Case{with_keys, "GET / HTTP/1.1\r\nHost: a\r\n\r\n", RefusalReason::no_zeromq},
          Case{with_keys, "", RefusalReason::broke_off}, Case{quick, "", RefusalReason::broke_off}}) {
        auto router = RouterSocket::bind(context, "tcp://127.0.0.1:*", c.options);
        auto watch = ConnectionWatch::watch(context, *router);
        send_garbage(router->endpoint(), c.bytes);
        std::vector<Refusal> seen;
        CHECK(soon(*watch, [&] {
            for (Refusal& refusal : watch->take_changes().refusals) seen.push_back(std::move(refusal));
            return !seen.empty();
        }));
        REQUIRE(seen.size() == 1);
        CHECK(seen[0].reason == c.reason);
    }
}

TEST_CASE("a watch and its socket may end in either order, whatever still happens") {
    const Context context;
    for (const bool watch_first : {true, false}) {
        auto router = RouterSocket::bind(context, "tcp://127.0.0.1:*");
        std::optional<ConnectionWatch> watch(std::move(*ConnectionWatch::watch(context, *router)));
        auto dealer = DealerSocket::connect(context, router->endpoint(), "d");
        REQUIRE(testing::send_once_connected(*dealer, {"x"}) == SendOutcome::delivered);
        if (watch_first) watch.reset();
        std::optional<RouterSocket> owner(std::move(*router));
        if (!watch_first) owner.reset();
        // ZeroMQ's own thread still runs: others can connect.
        auto other = RouterSocket::bind(context, "tcp://127.0.0.1:*");
        auto caller = DealerSocket::connect(context, other->endpoint(), "c");
        REQUIRE(testing::send_once_connected(*caller, {"y"}) == SendOutcome::delivered);
        CHECK(testing::receive_soon(*other)->frames == Frames{"y"});
    }
}

TEST_CASE("reasons have names") {
    for (const auto& [reason, name] : k_refusal_reason_names) CHECK(from_name<RefusalReason>(name) == reason);
}

TEST_CASE("peers that speak no ZeroMQ harm nobody") {
    const Context context;
    auto router = RouterSocket::bind(context, "tcp://127.0.0.1:*");
    REQUIRE(bool(router));
    for (const char* garbage :
         {"GET / HTTP/1.1\r\nHost: a\r\n\r\n", "\x01\x02\x03\x04\x05\x06\x07\x08\x09\x0A\x0B",
          "\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF"})
        send_garbage(router->endpoint(), garbage);
    auto dealer = DealerSocket::connect(context, router->endpoint(), "d");
    REQUIRE(testing::send_once_connected(*dealer, {"x"}) == SendOutcome::delivered);

    // ZeroMQ still understands its first version, which had no greeting: some garbage passes for a message of
    // a nameless peer. So what a socket receives has been checked by nobody yet.
    CHECK(soon(*router, [&] {
        const auto message = router->receive();
        return message && message->peer == "d" && message->frames == Frames{"x"};
    }));
}
