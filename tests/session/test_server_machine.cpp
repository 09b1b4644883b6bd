#include "pathscope/session/server_machine.hpp"

#include "pathscope/protocol/block_result.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

/// A world in which rounds end at once, and whose network can be stopped.
class StoppableWorld : public ServerWorld {
  public:
    bool send(Channel, Frames&& frames) override {
        if (stopped) return false;
        sent.push_back(std::move(frames));
        return true;
    }
    void begin(RoundJob job) override { begun.push_back(std::move(job)); }
    void cancel(std::uint64_t) override {}
    void cancel_all() override {}
    [[nodiscard]] std::uint64_t work_done() const override { return 0; }
    void load(RenderState state, Manifest) override { wanted = std::move(state); }

    bool stopped = false;
    std::vector<Frames> sent;
    std::vector<RoundJob> begun;
    std::optional<RenderState> wanted;
};

RenderState small_state() {
    RenderState state;
    state.scene = *parse_scene_file(
        R"({"obj": "a.obj", "camera": {"position": [0, 0, 4], "look_at": [0, 0, 0]}})", "a.json");
    state.files = hash_text(pack_manifest({}));
    state.camera = state.scene.cameras.front().view;
    state.settings.width = state.settings.height = 8;
    return state;
}

/// A server that hears what the test says.
struct StagedServer {
    TemporaryFolder folder{};
    StoppableWorld world{};
    ServerMachine server{{"server", "0", {"build", {}}, 1, 7, "client"}, SceneCache(folder.path()), world};
    TimeNs now = k_second_ns;

    void say(Message message) {
        const Channel channel = k_message_table[message.index()].channel;
        server.on_message(encode(std::move(message)), channel, now);
        server.on_timers(now);
    }
};

}  // namespace

TEST_CASE("a client that grants without end and takes no answer does not fill the server's memory") {
    constexpr std::uint64_t k_session = 77;
    constexpr std::uint32_t k_credits = 2;
    StagedServer stage;
    auto& [folder, world, server, now] = stage;
    const auto say = [&](Message message) { stage.say(std::move(message)); };

    // It joins: welcome, manifest, scene.
    const std::string packed = pack(PackValue(encode_state(small_state())));
    server.on_linked(std::string(16, 'i'), now);
    say(message::Welcome{k_session, ServerId{1}, 250, 5000, k_credits, Epoch{1}, 0, hash_text(packed),
                         packed});
    say(message::Manifest{hash_text(pack_manifest({})), pack_manifest({})});
    REQUIRE(world.wanted.has_value());
    LoadedScene loaded{*world.wanted, std::make_shared<const Scene>()};
    server.on_loaded(loaded, now);
    REQUIRE(server.working_on().has_value());

    // Nothing leaves any more; leases come, and their rounds end as if nothing were wrong.
    world.stopped = true;
    message::Lease lease;
    lease.session = k_session;
    lease.epoch = Epoch{1};
    lease.strategy = k_blocks_strategy;
    lease.rect = {0, 0, 4, 4};
    lease.count = lease.lease_ms = 1;
    const auto finish_one = [&] {
        RoundOutcome outcome;
        outcome.ticket = world.begun.back().ticket;
        outcome.result.emplace();
        outcome.result->sums.resize(16);
        world.begun.pop_back();
        server.on_outcome(outcome, now);
    };
    std::size_t most = 0;
    for (int i = 0; i < 1000; ++i) {
        lease.lease.value = std::uint64_t(i) + 1;
        say(lease);
        if (i % 3 == 0 && !world.begun.empty()) finish_one();
        most = std::max(most, server.unsent_answers() + server.leases());
    }
    CHECK(most >= 2 * k_credits);  // Else nothing was put to the test.
    CHECK(most <= 2 * k_credits + 9);

    // What was kept leaves once the network is back, and work goes on.
    world.stopped = false;
    server.on_timers(now);
    CHECK(server.unsent_answers() == 0);
    while (!world.begun.empty()) finish_one();
    lease.lease.value = 2000;
    say(lease);
    CHECK(world.begun.size() == 1);
}

TEST_CASE("a banned server leaves at once, is silent until the ban's end, and then says HELLO") {
    StagedServer stage;
    auto& [folder, world, server, now] = stage;
    const auto say = [&](Message message) { stage.say(std::move(message)); };
    const auto says_hello = [&] {
        world.sent.clear();
        server.on_timers(now);
        return !world.sent.empty();
    };
    const std::string packed = pack(PackValue(encode_state(small_state())));
    const message::Welcome welcome{77, ServerId{1}, 250, 5000, 2, Epoch{1}, 0, hash_text(packed), packed};
    server.on_linked(std::string(16, 'i'), now);
    say(welcome);
    REQUIRE(server.welcomed());

    say(message::Reject{RejectCode::version, "A flipped bit made a HELLO of something.", 0});
    CHECK(server.welcomed());
    say(message::Reject{RejectCode::banned, "It misbehaved too often.", 30'000});
    CHECK_FALSE(server.linked());
    CHECK_FALSE(server.ended());
    server.on_linked(std::string(16, 'j'), now);
    CHECK_FALSE(says_hello());
    now += 30 * k_second_ns - 1;
    CHECK_FALSE(says_hello());
    ++now;
    CHECK(server.next_timer(now) == now);
    CHECK(says_hello());

    // It hears of the ban once more, by the answer to its HELLO; but then the client ends, and another one may come.
    say(message::Reject{RejectCode::banned, "It misbehaved too often.", 30'000});
    now += k_second_ns;
    CHECK_FALSE(says_hello());
    server.on_connection_lost(now);
    now += k_second_ns;
    CHECK(says_hello());
}

TEST_CASE(
    "a scene that cannot be loaded, though another state of it came meanwhile, has all its files fetched "
    "anew") {
    StagedServer stage;
    auto& [folder, world, server, now] = stage;
    const std::string bytes = "v 0 0 0\n";
    Manifest manifest;
    manifest.files.push_back({"a.obj", bytes.size(), hash_text(bytes)});
    const auto state_of = [&](std::uint32_t seed) {
        RenderState state = small_state();
        state.files = hash_text(pack_manifest(manifest));
        state.settings.seed = seed;
        return state;
    };
    const auto snapshot_of = [&](const RenderState& state, std::uint32_t number) {
        const std::string packed = pack(PackValue(encode_state(state)));
        return message::Snapshot{77, Epoch{number}, number, hash_text(packed), packed};
    };
    const auto asked_for = [&](MessageType type) {
        bool asked = false;
        for (const Frames& frames : std::exchange(world.sent, {})) asked |= frames[0][3] == char(type);
        return asked;
    };
    const std::string packed = pack(PackValue(encode_state(state_of(1))));
    server.on_linked(std::string(16, 'i'), now);
    stage.say(message::Welcome{77, ServerId{1}, 250, 5000, 2, Epoch{1}, 1, hash_text(packed), packed});
    stage.say(message::Manifest{hash_text(pack_manifest(manifest)), pack_manifest(manifest)});
    stage.say(message::Piece{hash_text(bytes), 0, bytes.size(), bytes});
    REQUIRE(world.wanted.has_value());

    stage.say(snapshot_of(state_of(2), 2));
    LoadedScene damaged{*std::exchange(world.wanted, std::nullopt),
                        failed("a.obj: it is not what its hash says.")};
    server.on_loaded(damaged, now);
    CHECK_FALSE(SceneCache(folder.path()).holds(hash_text(bytes), bytes.size()));
    CHECK(asked_for(MessageType::manifest_request));
    stage.say(message::Manifest{hash_text(pack_manifest(manifest)), pack_manifest(manifest)});
    CHECK(asked_for(MessageType::piece_request));
    stage.say(message::Piece{hash_text(bytes), 0, bytes.size(), bytes});
    REQUIRE(world.wanted.has_value());
    LoadedScene sound{*world.wanted, std::make_shared<const Scene>()};
    server.on_loaded(sound, now);
    CHECK(server.working_on() == state_hash(state_of(2)));
}

TEST_CASE("a scene that is loaded late does not replace the one that the client went back to") {
    constexpr std::uint64_t k_session = 77;
    StagedServer stage;
    auto& [folder, world, server, now] = stage;
    const auto say = [&](Message message) { stage.say(std::move(message)); };
    const auto render = [&](std::uint64_t number, Epoch epoch) {
        message::Lease lease;
        lease.session = k_session;
        lease.epoch = epoch;
        lease.strategy = k_blocks_strategy;
        lease.rect = {0, 0, 4, 4};
        lease.lease.value = number;
        lease.count = lease.lease_ms = 1;
        say(lease);
        return world.begun.empty() ? nullptr : world.begun.back().scene;
    };
    RenderState other = small_state();
    other.options.smoothing = !other.options.smoothing;  // Another scene of the same files.
    const std::string first = pack(PackValue(encode_state(small_state())));
    const std::string second = pack(PackValue(encode_state(other)));
    const auto scene_of_first = std::make_shared<const Scene>();

    server.on_linked(std::string(16, 'i'), now);
    say(message::Welcome{k_session, ServerId{1}, 250, 5000, 2, Epoch{1}, 0, hash_text(first), first});
    say(message::Manifest{hash_text(pack_manifest({})), pack_manifest({})});
    LoadedScene loaded{small_state(), scene_of_first};
    server.on_loaded(loaded, now);
    CHECK(render(1, Epoch{1}) == scene_of_first);

    say(message::Snapshot{k_session, Epoch{2}, 1, hash_text(second), second});
    say(message::Manifest{hash_text(pack_manifest({})), pack_manifest({})});
    REQUIRE(world.wanted.has_value());
    CHECK(world.wanted->options.smoothing == other.options.smoothing);
    CHECK_FALSE(server.working_on().has_value());
    say(message::Snapshot{k_session, Epoch{3}, 2, hash_text(first), first});
    REQUIRE(server.working_on().has_value());

    LoadedScene late{other, std::make_shared<const Scene>()};
    server.on_loaded(late, now);
    CHECK(server.working_on() == hash_text(first));
    world.begun.clear();
    CHECK(render(2, Epoch{3}) == scene_of_first);
}
