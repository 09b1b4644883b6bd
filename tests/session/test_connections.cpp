/// From HELLO to the end of a connection, one event at a time: who is let in, who is heard to the last word, and how a server
/// comes back whose connection is not what it seems to be.

#include "pathscope/protocol/codec.hpp"

#include "silence.hpp"
#include "staged_cluster.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

std::ptrdiff_t count(const std::vector<MessageType>& all, MessageType type) {
    return std::count(all.begin(), all.end(), type);
}

message::Hello hello_of(const StagedCluster::Server& server, const BitsIdentity& bits) {
    return {server.instance(), "server-1", "0", bits.build, 1, 1, bits.golden};
}

/// A connection is lost, and the client probes before it reads on.
void lose_a_connection(StagedCluster& stage) {
    stage.client().on_connection_lost(stage.now());
    stage.client().on_timers(stage.now());
}

BitsIdentity other_bits() {
    BitsIdentity bits = own_bits();
    ++bits.golden[0];
    return bits;
}

}  // namespace

TEST_CASE(
    "a server that leaves is heard before its connection counts as lost; one that dies is lost at once") {
    const Silence silence;
    for (const bool says_so : {true, false}) {
        CAPTURE(says_so);
        StagedCluster stage(4096);
        StagedCluster::Server& a = stage.add_server();
        StagedCluster::Server& b = stage.add_server();
        REQUIRE(stage.pass_until([&] { return stage.committed() > 0; }));
        says_so ? a.leave() : void(a.killed = true);
        lose_a_connection(stage);
        CHECK(stage.client().progress().servers_known == 2);
        stage.pass(2 * k_millisecond_ns);
        CHECK(stage.client().progress().servers_known == 1);
        CHECK(stage.store().total(Counter::died) == (says_so ? 0 : 1));
        CHECK(stage.client().work().indirect_ledger().outstanding(ServerId{1}) == 0);

        // Who cannot be reached for a moment is there still.
        b.killed = true;
        lose_a_connection(stage);
        b.killed = false;
        stage.pass(200 * k_millisecond_ns);
        CHECK(stage.client().progress().servers_known == 1);
    }
}

TEST_CASE(
    "who is unreachable a moment after its connection ended is given up within a millisecond; later, later") {
    const Silence silence;
    for (const TimeNs moment : {TimeNs(0), TimeNs(150'000), 20 * k_millisecond_ns}) {
        CAPTURE(moment);
        StagedCluster stage(4096);
        StagedCluster::Server& a = stage.add_server();
        stage.add_server();
        REQUIRE(stage.pass_until([&] { return stage.committed() > 0; }));
        // The end is told before the socket knows it.
        const TimeNs end = stage.now();
        TimeNs now = end;
        stage.client().on_connection_lost(now);
        for (;; now = std::max(now + 1, stage.client().next_timer(now))) {
            a.killed = now >= end + moment;
            stage.client().on_timers(now);
            if (stage.client().progress().servers_known == 1 || now >= end + k_second_ns) break;
        }
        CHECK(stage.client().progress().servers_known == 1);
        CHECK(now - end <= (moment < k_millisecond_ns ? k_millisecond_ns / 2 : 3 * moment));
    }
}

TEST_CASE(
    "connections that only come and go, as fast as they can, make the client ask its servers no more often "
    "than it can bear") {
    const Silence silence;
    StagedCluster stage(4096);
    StagedCluster::Server& a = stage.add_server();
    stage.add_server();
    REQUIRE(stage.pass_until([&] { return stage.committed() > 0; }));
    const std::ptrdiff_t before = count(a.heard, MessageType::ping);
    for (TimeNs t = 0; t < k_millisecond_ns; t += 1'000) {
        stage.client().on_connection_lost(stage.now() + t);
        stage.client().on_timers(stage.now() + t);
    }
    stage.pass(10 * k_millisecond_ns);
    CHECK(count(a.heard, MessageType::ping) - before > 10);
    CHECK(count(a.heard, MessageType::ping) - before < 60);
}

TEST_CASE(
    "a HELLO that is said again is welcomed again; with other bits it is refused, and changes nothing") {
    const Silence silence;
    StagedCluster stage(4096, [](ClientConfig& config, RenderSettings&) { config.relaxed = true; });
    StagedCluster::Server& a = stage.add_server();
    REQUIRE(stage.pass_until([&] { return stage.committed() > 0; }));
    const auto says = [&](const BitsIdentity& bits) {
        stage.client().on_message(a.instance(), encode(hello_of(a, bits)), Channel::monitor, stage.now());
        stage.pass(20 * k_millisecond_ns);
    };
    says(own_bits());
    CHECK(count(a.heard, MessageType::welcome) == 2);
    CHECK(count(a.heard, MessageType::reject) == 0);
    CHECK(stage.client().progress().servers_ready == 1);
    const std::uint64_t before = stage.committed();

    says(other_bits());
    CHECK(count(a.heard, MessageType::welcome) == 2);
    CHECK(count(a.heard, MessageType::reject) == 1);
    CHECK(stage.client().conduct().points(conduct_name("", "server-1", ""), stage.now()) > 0);
    CHECK(stage.committed() > before);  // It works on, and what it gives is what its first HELLO promised.
    CHECK(stage.client().differing_rounds() == 0);
    CHECK(stage.store().total(Counter::servers_joined) == 1);
}

TEST_CASE("a bit that flips in a routing id ends nobody: the server dials again, and works") {
    // The routing id is a part of ZeroMQ's handshake, and no seal of ours covers it.
    const Silence silence;
    for (const Channel channel : {Channel::monitor, Channel::frames}) {
        CAPTURE(name_of(channel));
        StagedCluster stage(64);
        StagedCluster::Server& a = stage.add_server();
        a.flipped = channel;
        REQUIRE(stage.pass_until([&] { return stage.committed() > 0; }, 10 * k_second_ns));
        CHECK(a.links == 2);
        CHECK_FALSE(a.machine().ended());
        CHECK(count(a.heard, MessageType::reject) == (channel == Channel::monitor ? 1 : 0));
        REQUIRE(stage.pass_until([&] { return stage.client().complete(); }));
        CHECK(stage.picture_is_right());
    }
}

TEST_CASE("a server that owes answers, or that hears the client out, is not sent to dial again") {
    const Silence silence;
    StagedCluster stage(4096);
    StagedCluster::Server& a = stage.add_server();
    REQUIRE(stage.pass_until([&] { return stage.committed() > 0; }));
    // It says that it takes nothing for now: CREDIT 0, again and again.
    const std::uint64_t session = a.leases.front().session;
    a.renders = false;
    for (int second = 0; second < 20; ++second) {
        stage.client().on_message(a.instance(), encode(message::Credit{session, 0, LeaseId{1'000'000}}),
                                  Channel::frames, stage.now());
        stage.pass(k_second_ns);
    }
    CHECK(count(a.heard, MessageType::who) == 0);
    CHECK(a.links == 1);
}

TEST_CASE("a peer of another version is told so once a second, however often it asks") {
    const Silence silence;
    StagedCluster stage;
    Frames foreign = encode(message::Hello{std::string(16, 'x'), "n", "v", "b", 1, 0, {}});
    foreign[0] = message_head(99, std::uint8_t(MessageType::hello), foreign[1]);
    for (int i = 0; i < 100; ++i) {
        stage.client().on_message("a stranger......", foreign, Channel::monitor, stage.now());
        stage.pass(20 * k_millisecond_ns);
    }
    CHECK(count(stage.to_strangers, MessageType::reject) == 2);
    CHECK(stage.store().total(Counter::bad_messages) == 100);

    // In all, no more than 256 are answered in a second.
    stage.pass(k_second_ns);
    stage.to_strangers.clear();
    for (int i = 0; i < 1000; ++i)
        stage.client().on_message(fmt::format("stranger {:07}", i), foreign, Channel::monitor, stage.now());
    CHECK(stage.to_strangers.size() == 256);
}
