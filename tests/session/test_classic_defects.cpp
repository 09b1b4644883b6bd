/// What the classic distributed path tracer did wrong, as tests that ours would fail if it did so too. The table of all
/// thirteen, S1 to S13, with the tests elsewhere that carry their numbers: docs/testing.md.

#include "pathscope/protocol/block_result.hpp"

#include "silence.hpp"
#include "staged_cluster.hpp"

#include "log_capture.hpp"
#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr std::uint64_t k_rounds =
    4 * 64 / 2;  ///< Of the stage's frame: blocks, samples, samples of a round.

std::size_t count(const std::vector<MessageType>& all, MessageType type) {
    return std::size_t(std::count(all.begin(), all.end(), type));
}

/// The answer of a server to a lease, with so many pixels.
message::Tile tile_for(const message::Lease& lease, std::size_t pixels) {
    message::Tile tile = message::make_tile(lease);
    put_block_result(tile, std::vector<PixelSum>(pixels, PixelSum{1, 1, 1}));
    return tile;
}

/// A stage with one server that has leases in work and does not render.
struct BusyServer {
    StagedCluster stage;
    StagedCluster::Server& server = stage.add_server();

    BusyServer() {
        server.renders = false;
        REQUIRE(stage.pass_until([this] { return !server.leases.empty(); }));
    }
    void answer(const message::Tile& tile) {
        stage.client().on_message(server.instance(), encode(tile), Channel::frames, stage.now());
    }
    [[nodiscard]] bool no_indirect_light() {
        const auto sums = stage.client().work().indirect().sums();
        return std::all_of(sums.begin(), sums.end(), [](const PixelSum& sum) { return sum == PixelSum{}; });
    }
};

}  // namespace

TEST_CASE(
    "S1: a server that joins or dies restarts nobody: what is committed stays, and is not rendered again") {
    const LogCapture quiet;
    StagedCluster stage;
    StagedCluster::Server& a = stage.add_server();
    StagedCluster::Server& b = stage.add_server();
    std::uint64_t before = 0;
    const auto rises_to = [&](std::uint64_t rounds) {
        return stage.pass_until([&] {
            CHECK(stage.committed() >= before);
            before = stage.committed();
            return before >= rounds;
        });
    };
    REQUIRE(rises_to(k_rounds / 4));
    StagedCluster::Server& c = stage.add_server();
    REQUIRE(rises_to(k_rounds / 2));
    CHECK(!c.leases.empty());
    b.killed = true;
    stage.client().on_connection_lost(stage.now());
    REQUIRE(rises_to(k_rounds));
    CHECK(stage.picture_is_right());
    // Each round was leased once, but for the two at most that died with their server, those that could not be sent to it
    // any more, and the copies at the end.
    const LedgerCounts& counts = stage.client().work().indirect_ledger().counts();
    CHECK(counts.released <= 2);
    CHECK(counts.granted <= k_rounds + 2 + counts.released + counts.copied);
    CHECK(a.leases.size() + b.leases.size() + c.leases.size() <= k_rounds + 2 + counts.copied);
    CHECK(stage.client().epoch() == Epoch{1});
    CHECK(count(a.heard, MessageType::welcome) == 1);
}

TEST_CASE("S3: a server that was given up by mistake joins again when it is heard, and works") {
    const LogCapture quiet;
    StagedCluster stage(4096);
    StagedCluster::Server& a = stage.add_server();
    stage.add_server();
    REQUIRE(stage.pass_until([&] { return a.machine().working_on().has_value(); }));
    // The client finds it silent; it does not find the client silent, which would take it five seconds.
    a.cut = true;
    REQUIRE(stage.pass_until([&] { return stage.store().total(Counter::died) == 1; }, 2 * k_second_ns));
    CHECK(stage.client().progress().servers_known == 1);
    a.cut = false;
    const std::size_t worked = a.leases.size();
    REQUIRE(stage.pass_until([&] { return a.leases.size() > worked + 2; }, 2 * k_second_ns));
    CHECK(count(a.heard, MessageType::who) >= 1);
    CHECK(a.links == 2);  // As somebody new, with an id that no late message of the old one carries.
    CHECK(count(a.heard, MessageType::welcome) == 2);
    CHECK(stage.client().progress().servers_known == 2);
}

TEST_CASE("S5: states are absolute: whatever the input channel loses, servers end with the client's view") {
    const LogCapture quiet;
    StagedCluster stage(4096);
    StagedCluster::Server& a = stage.add_server();
    StagedCluster::Server& b = stage.add_server();
    REQUIRE(stage.pass_until([&] { return stage.committed() > 0; }));
    const auto turn = [&](double to) {
        RenderState state = stage.client().state();
        state.camera.position.x = float(to);
        ++state.settings.seed;
        stage.client().change_state(state, nullptr, stage.now());
    };
    for (int move = 1; move <= 5; ++move) {
        stage.lose_inputs = move % 2 == 0 || move == 5;  // Some arrive, into a gap; the last does not.
        turn(move);
        stage.pass(3 * k_millisecond_ns);
    }
    StagedCluster::Server& late = stage.add_server();  // Joins after all of them.
    stage.pass(k_second_ns);
    const Digest view = state_hash(stage.client().state());
    for (const StagedCluster::Server* server : {&a, &b, &late}) CHECK(server->machine().working_on() == view);
}

TEST_CASE("S7: a result of another layout, or of another size than its lease, changes nothing") {
    const LogCapture quiet;
    BusyServer busy;
    StagedCluster& stage = busy.stage;
    const message::Lease old = busy.server.leases.front();

    // More and fewer pixels than the lease has: dropped and counted, and the round is open again.
    busy.answer(tile_for(old, 8 * 8 + 1));
    busy.answer(tile_for(busy.server.leases.back(), 8 * 8 - 1));
    CHECK(stage.committed() == 0);
    CHECK(busy.no_indirect_light());
    CHECK(stage.store().total(Counter::bad_messages) == 2);

    // The picture shrinks, and a tile comes that was leased before: of a block that is no more.
    RenderState state = stage.client().state();
    state.settings.width = state.settings.height = 4;
    stage.client().change_state(state, nullptr, stage.now());
    busy.answer(tile_for(old, 8 * 8));
    CHECK(stage.client().work().indirect_ledger().counts().stale == 1);
    CHECK(stage.committed() == 0);
    CHECK(busy.no_indirect_light());
    busy.server.renders = true;
    REQUIRE(stage.pass_until([&] { return stage.client().complete(); }));
    CHECK(stage.picture_is_right());
}

TEST_CASE("S8: whoever did not say HELLO is no server, whatever else it says") {
    const LogCapture quiet;
    BusyServer busy;
    StagedCluster& stage = busy.stage;
    const std::size_t known = stage.store().servers().size();
    const message::Lease lease = busy.server.leases.front();
    const std::string stranger = "a stranger......";
    const auto says = [&](const Message& message, Channel channel) {
        stage.client().on_message(stranger, encode(message), channel, stage.now());
        stage.pass(k_second_ns);
        CHECK(stage.client().progress().servers_known == 1);
        CHECK(stage.store().servers().size() == known);
        CHECK(stage.committed() == 0);
    };
    says(tile_for(lease, 8 * 8), Channel::frames);  // Even a true answer to somebody else's lease.
    says(message::Credit{lease.session, 2, LeaseId{}}, Channel::frames);
    says(message::Ready{lease.session, lease.epoch, 0, state_hash(stage.client().state())}, Channel::monitor);
    says(message::Ping{}, Channel::monitor);
    CHECK(busy.no_indirect_light());
    CHECK(stage.store().total(Counter::bad_messages) == 4);
    CHECK(count(stage.to_strangers, MessageType::who) == 4);
    CHECK(stage.to_strangers.size() == 4);
}

TEST_CASE("S11: servers that were there before the client, and after it died, find the next one") {
    const LogCapture quiet;
    StagedCluster stage;
    StagedCluster::Server& a = stage.add_server();
    a.cut = true;  // No client far and wide: HELLO goes unheard, for a minute.
    stage.pass(60 * k_second_ns);
    CHECK(!a.machine().welcomed());
    a.cut = false;
    REQUIRE(stage.pass_until([&] { return stage.committed() > 0; }, 6 * k_second_ns));

    stage.restart_client();  // It died without a word, and another has its ports.
    REQUIRE(stage.pass_until([&] { return stage.client().complete(); }, 6 * k_second_ns));
    CHECK(stage.picture_is_right());
    CHECK(a.links == 2);
    CHECK(stage.store().total(Counter::rounds_committed) == k_rounds);
}

TEST_CASE("S12: every round is in the picture when it comes, with the number of its samples") {
    const LogCapture quiet;
    BusyServer busy;
    StagedCluster& stage = busy.stage;
    const message::Lease lease = busy.server.leases.front();
    busy.answer(tile_for(lease, 8 * 8));
    CHECK(stage.client().progress().indirect == doctest::Approx(1.0 / k_rounds));
    const FrameSums& sums = stage.client().work().indirect();
    CHECK(sums.samples_of_block(lease.unit) == lease.count);
    CHECK(sums.sum_at(lease.rect.x, lease.rect.y) == PixelSum{1, 1, 1});
}

TEST_CASE("S13: without servers the client renders indirect light itself, the same to the last bit") {
    const LogCapture quiet;
    StagedCluster stage;
    StagedCluster::Server& a = stage.add_server();
    REQUIRE(stage.pass_until([&] { return stage.committed() > k_rounds / 4; }));
    a.killed = true;
    stage.client().on_connection_lost(stage.now());
    REQUIRE(stage.pass_until([&] { return stage.client().complete(); }));
    CHECK(stage.picture_is_right());
    CHECK(stage.store().server(k_local_server)->total(Counter::rounds_committed) > k_rounds / 4);
}
