/// Client and servers over real sockets on loopback, in one process: whatever happens, the image has the same bits as
/// the render of one machine.

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "pathscope/net/dealer.hpp"
#include "pathscope/net/poller.hpp"
#include "pathscope/session/admission.hpp"
#include "pathscope/session/server_session.hpp"

#include "small_job.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

ClientConfig listening(int min_servers) {
    ClientConfig config;
    config.ports = {0, 0, 0};
    config.any_ports = true;
    config.listens = true;
    config.min_servers = min_servers;
    config.threads = 1;
    config.block_size = 16;
    config.round_samples = 2;
    return config;
}

/// A server on a thread of its own; it is told to stop at the end of the scope.
class RunningServer {
  public:
    RunningServer(std::array<int, 3> ports, const std::filesystem::path& cache, double samples_per_second = 0,
                  ServerConfig config = {}) {
        config.ports = ports;
        config.name = "test";
        config.threads = 1;
        config.cache_folder = cache;
        config.samples_per_second = samples_per_second;
        session_ = std::move(*ServerSession::create(config));
        thread_ = std::thread([this] { result_ = session_->run(); });
    }
    ~RunningServer() {
        stop();
        thread_.join();
    }
    void stop() { session_->request_stop(); }
    [[nodiscard]] Result<void> wait() {
        thread_.join();
        thread_ = std::thread([] {});
        return result_;
    }

  private:
    std::unique_ptr<ServerSession> session_;
    std::thread thread_;
    Result<void> result_;
};

/// Holds up whoever passes, until it is opened.
class Gate {
  public:
    void pass() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return open_; });
    }
    void open() {
        {
            const std::lock_guard lock(mutex_);
            open_ = true;
        }
        changed_.notify_all();
    }

  private:
    std::mutex mutex_;
    std::condition_variable changed_;
    bool open_ = false;
};

}  // namespace

TEST_CASE("S9: the image has the same bits for any number of servers, schedule, block and round size") {
    const SmallJob small;
    const Digest expected = small.hash_of_one_machine();
    const TemporaryFolder cache;  // Empty at first: the scene travels over the wire.
    struct Case {
        int servers, block, round;
        ScheduleKind schedule;
    };
    for (const Case& c :
         {Case{0, 32, 4, ScheduleKind::pull}, Case{1, 32, 4, ScheduleKind::pull},
          Case{2, 16, 3, ScheduleKind::static_shares}, Case{3, 7, 1, ScheduleKind::weighted_shares}}) {
        CAPTURE(c.servers);
        EventStore store;
        ClientConfig config = listening(c.servers);
        config.block_size = c.block;
        config.round_samples = std::uint32_t(c.round);
        config.schedule = c.schedule;
        config.detector = DetectorKind::fixed;  // Patient: no server is given up because the machine is busy.
        const auto client = std::move(*ClientSession::create(config, small.job(), store));
        std::vector<std::unique_ptr<RunningServer>> servers;
        for (int i = 0; i < c.servers; ++i)
            servers.push_back(std::make_unique<RunningServer>(ports_of(client->endpoints()), cache.path()));
        REQUIRE(finish(*client));
        CHECK(hash_of(*client) == expected);
        CHECK(store.total(Counter::rounds) == store.total(Counter::rounds_committed));
        CHECK(bool(client->work().indirect_ledger().check_invariants()));
        CHECK(store.servers().size() == std::size_t(c.servers) + 1);
        if (c.servers > 0) CHECK(store.server(k_local_server)->total(Counter::rounds_committed) == 0);
    }
}

TEST_CASE("a server that leaves in mid-frame gives its rounds to the others, one that comes late joins in") {
    const SmallJob small(64);
    const TemporaryFolder cache;
    EventStore store;
    const auto client = std::move(*ClientSession::create(listening(1), small.job(), store));
    // Slow, so that it is sure to be in mid-frame when it is told to leave.
    auto first = std::make_unique<RunningServer>(ports_of(client->endpoints()), cache.path(), 20'000);
    REQUIRE(step_until(*client, [&] { return client->work().indirect_progress() > 0.05; }));
    first->stop();
    const RunningServer second(ports_of(client->endpoints()), cache.path());
    REQUIRE(finish(*client));
    CHECK(hash_of(*client) == small.hash_of_one_machine());
    CHECK(store.total(Counter::rounds) == store.total(Counter::rounds_committed));
}

TEST_CASE("S13: when the last server leaves in mid-frame, the client carries on alone") {
    const SmallJob small(32);
    const TemporaryFolder cache;
    EventStore store;
    const auto client = std::move(*ClientSession::create(listening(1), small.job(), store));
    RunningServer server(ports_of(client->endpoints()), cache.path(), 20'000);
    REQUIRE(step_until(*client, [&] { return client->work().indirect_progress() > 0.05; }));
    server.stop();
    REQUIRE(finish(*client));
    CHECK(hash_of(*client) == small.hash_of_one_machine());
    CHECK(store.server(k_local_server)->total(Counter::rounds_committed) > 0);
    CHECK(store.server(ServerId{1})->total(Counter::rounds_committed) > 0);
}

TEST_CASE(
    "S2: a server that renders for seconds without a pause answers heartbeats, and is not taken for dead") {
    const SmallJob small(4);
    const TemporaryFolder cache;
    EventStore store;
    ClientConfig config = listening(1);
    config.block_size = 128;  // The whole frame is one round,
    config.round_samples = 4;
    const auto client = std::move(*ClientSession::create(config, small.job(), store));
    // which takes four times as long as silence is borne: 70 * 40 * 4 samples at this speed are 2.8 s.
    const RunningServer server(ports_of(client->endpoints()), cache.path(), 4000);
    REQUIRE(finish(*client));
    CHECK(hash_of(*client) == small.hash_of_one_machine());
    CHECK(store.total(Counter::servers_joined) == 1);
    CHECK(store.total(Counter::died) == 0);
    CHECK(store.server(ServerId{1})->total(Counter::rounds_committed) == 1);
}

TEST_CASE("S10: what a server filters is what the client gets, block for block") {
    SmallJob small(4);
    const TemporaryFolder cache;
    const auto served = [&](FilterPlace place, int block_size) {
        small.state.settings.filter = place;
        EventStore store;
        ClientConfig config = listening(1);
        config.block_size = block_size;
        config.round_samples = 4;  // One round for each block: the filter takes a round as it finds it.
        const auto client = std::move(*ClientSession::create(config, small.job(), store));
        const RunningServer server(ports_of(client->endpoints()), cache.path());
        REQUIRE(finish(*client));
        return hash_of(*client);
    };
    const auto local = [&](FilterPlace place, int block_size) {
        small.state.settings.filter = place;
        const RenderSettings& settings = small.state.settings;
        const LocalRender one = render_locally(*small.scene, small.state.camera, settings, block_size, 1);
        return image_hash(compose_frame(one.direct, one.indirect, settings, {}, 1).combined);
    };
    const Digest off = served(FilterPlace::off, 16);
    const Digest at_server = served(FilterPlace::server, 16);
    CHECK(off == local(FilterPlace::off, 16));
    CHECK(at_server != off);
    CHECK(at_server == local(FilterPlace::server, 16));
    CHECK(at_server != local(FilterPlace::server, 128));  // Seams: who wants none filters at the client.
}

TEST_CASE("an input in mid-frame reaches the servers, and no result of the old epoch reaches the image") {
    const SmallJob small(64);
    const TemporaryFolder cache;
    EventStore store;
    ClientConfig config = listening(2);
    config.detector = DetectorKind::fixed;  // Patient: no server is given up because the machine is busy.
    const auto client = std::move(*ClientSession::create(config, small.job(), store));
    const RunningServer a(ports_of(client->endpoints()), cache.path()),
        b(ports_of(client->endpoints()), cache.path());
    RenderState state = small.state;
    for (int move = 1; move <= 3; ++move) {
        REQUIRE(step_until(*client, [&] { return client->work().indirect_progress() > 0.1; }));
        state.camera.position.x += 30;
        state.settings.seed = std::uint32_t(move);
        client->change_state(state);
        CHECK(client->epoch() == Epoch{std::uint32_t(move + 1)});
    }
    REQUIRE(finish(*client));
    CHECK(hash_of(*client) == small.hash_of_one_machine(state));
    CHECK(bool(client->work().indirect_ledger().check_invariants()));
    CHECK(store.server(k_local_server)->total(Counter::rounds_committed) == 0);
}

TEST_CASE("adaptive rounds have the same bits alone and with servers, scouts travelling over the wire") {
    SmallJob small(24);
    small.state.settings.direct_spp = 8;
    const TemporaryFolder cache;
    std::vector<Digest> hashes;
    std::vector<std::optional<double>> errors;
    for (const int servers : {0, 1, 3}) {
        EventStore store;
        ClientConfig config = listening(servers);
        config.sampling.adaptive = true;
        const auto client = std::move(*ClientSession::create(config, small.job(), store));
        std::vector<std::unique_ptr<RunningServer>> running;
        for (int i = 0; i < servers; ++i)
            running.push_back(std::make_unique<RunningServer>(ports_of(client->endpoints()), cache.path()));
        REQUIRE(finish(*client));
        CHECK(store.total(Counter::rounds) == store.total(Counter::rounds_committed));
        CHECK(store.total(Counter::bad_messages) == 0);
        CHECK(bool(client->work().indirect_ledger().check_invariants()));
        if (servers > 0) CHECK(store.server(k_local_server)->total(Counter::rounds_committed) == 0);
        hashes.push_back(hash_of(*client));
        errors.push_back(client->work().estimated_error());
    }
    CHECK(errors[0].value() > 0);
    for (std::size_t i = 1; i < hashes.size(); ++i) {
        CHECK(hashes[i] == hashes[0]);
        CHECK(errors[i] == errors[0]);
    }
}

TEST_CASE("S11: a server that loses its client waits for the next one, and serves it") {
    const SmallJob small;
    const TemporaryFolder cache;
    EventStore first_store, second_store;
    auto client = std::move(*ClientSession::create(listening(1), small.job(), first_store));
    ClientConfig again = listening(1);
    again.ports = ports_of(client->endpoints());
    again.any_ports = false;
    const RunningServer server(again.ports, cache.path());
    REQUIRE(finish(*client));
    client.reset();
    client = std::move(*ClientSession::create(again, small.job(), second_store));
    REQUIRE(finish(*client));
    CHECK(hash_of(*client) == small.hash_of_one_machine());
    CHECK(second_store.server(ServerId{1})->total(Counter::rounds_committed) > 0);
}

TEST_CASE("garbage, foreign versions and unknown peers are dropped and counted, and the image is the same") {
    const SmallJob small(32);
    const TemporaryFolder cache;
    EventStore store;
    const auto client = std::move(*ClientSession::create(listening(1), small.job(), store));
    const std::array<int, 3> ports = ports_of(client->endpoints());

    const Context context;
    const auto dial = [&](int port) {
        return std::move(
            *DealerSocket::connect(context, "tcp://127.0.0.1:" + std::to_string(port), random_routing_id()));
    };
    DealerSocket monitor = dial(ports[1]), frames = dial(ports[2]);
    const auto send = [&](DealerSocket& socket, Frames message) {
        REQUIRE(step_until(*client, [&] { return socket.send(Frames(message)) == SendOutcome::delivered; }));
    };
    HashRng rng(1);
    for (int i = 0; i < 200; ++i) {
        Frames message(1 + rng.next_u32() % 4);
        for (std::string& frame : message)
            for (std::uint32_t n = rng.next_u32() % 40; n > 0; --n) frame += char(rng.next_u32());
        send(i % 2 ? monitor : frames, message);
    }
    // A result from somebody who never said HELLO, and a HELLO of another protocol.
    message::Tile tile;
    tile.session = 1;
    tile.lease = LeaseId{1};
    tile.strategy = "blocks";
    tile.count = 2;
    tile.codec = "raw";
    send(frames, encode(tile));
    Frames foreign =
        encode(message::Hello{std::string(16, 'x'), "n", "v", own_bits().build, 1, 0, own_bits().golden});
    foreign[0] = message_head(99, std::uint8_t(MessageType::hello), foreign[1]);
    send(monitor, foreign);
    std::optional<Frames> answer;
    Decoded reject = DecodeError{};
    REQUIRE(step_until(*client, [&] {
        answer = monitor.receive();
        if (!answer) return false;
        reject = decode(std::move(*answer), Role::server, Channel::monitor);
        return reject && std::holds_alternative<message::Reject>(*reject);
    }));
    CHECK(std::get<message::Reject>(*reject).code == RejectCode::version);

    const RunningServer server(ports, cache.path());
    REQUIRE(finish(*client));
    CHECK(hash_of(*client) == small.hash_of_one_machine());
    CHECK(store.total(Counter::bad_messages) >= 202);
}

TEST_CASE("a server of another build is refused, and says why") {
    const SmallJob small;
    EventStore store;
    const auto client = std::move(*ClientSession::create(listening(1), small.job(), store));
    const Context context;
    const std::string id = random_routing_id();
    DealerSocket monitor = std::move(*DealerSocket::connect(
        context, "tcp://127.0.0.1:" + std::to_string(ports_of(client->endpoints())[1]), id));
    REQUIRE(step_until(*client, [&] {
        return monitor.send(encode(message::Hello{id, "old", "0.0", "another build", 1, 0,
                                                  own_bits().golden})) == SendOutcome::delivered;
    }));
    std::optional<Frames> answer;
    REQUIRE(step_until(*client, [&] { return (answer = monitor.receive()).has_value(); }));
    Decoded reject = decode(std::move(*answer), Role::server, Channel::monitor);
    REQUIRE(bool(reject));
    CHECK(std::get<message::Reject>(*reject).code == RejectCode::build);
    CHECK(client->progress().servers_known == 0);
}

TEST_CASE("a port in use is a sentence that names it") {
    const SmallJob small;
    EventStore store;
    const auto client = std::move(*ClientSession::create(listening(0), small.job(), store));
    ClientConfig config = listening(0);
    config.ports = ports_of(client->endpoints());
    config.any_ports = false;
    config.ports_were_chosen = true;
    const auto second = ClientSession::create(config, small.job(), store);
    REQUIRE_FALSE(bool(second));
    CHECK(second.error().message.find(std::to_string(config.ports[0])) != std::string::npos);
}

TEST_CASE("a server of other bits is refused and told why; a relaxed client takes it, and marks the image") {
    const SmallJob small;
    const TemporaryFolder cache;
    ServerConfig foreign;
    foreign.claimed_bits = own_bits();
    ++foreign.claimed_bits->golden[0];
    {
        EventStore store;
        const auto client = std::move(*ClientSession::create(listening(1), small.job(), store));
        RunningServer server(ports_of(client->endpoints()), cache.path(), 0, foreign);
        std::atomic<bool> ended{false};
        Result<void> result;
        std::thread waiting([&] {
            result = server.wait();
            ended.store(true);
        });
        CHECK(step_until(*client, [&] { return ended.load(); }));
        waiting.join();
        REQUIRE(!result);
        CHECK(result.error().message.find("golden round has the bits") != std::string::npos);
        CHECK(store.total(Counter::servers_joined) == 0);
        // One of the right bits is welcome all the same.
        const RunningServer good(ports_of(client->endpoints()), cache.path());
        REQUIRE(finish(*client));
        CHECK(client->differing_rounds() == 0);
    }
    EventStore store;
    ClientConfig config = listening(1);
    config.relaxed = true;
    const auto client = std::move(*ClientSession::create(config, small.job(), store));
    const RunningServer server(ports_of(client->endpoints()), cache.path(), 0, foreign);
    REQUIRE(finish(*client));
    CHECK(hash_of(*client) == small.hash_of_one_machine());  // It only says that its bits differ.
    CHECK(client->differing_rounds() > 0);
    CHECK(client->differing_rounds() == store.total(Counter::differing_rounds));
    CHECK(client->differing_rounds() == store.server(ServerId{1})->total(Counter::rounds_committed));
    RenderState again = small.state;
    again.settings.seed = 8;
    client->change_state(again);
    CHECK(client->differing_rounds() == 0);  // Of the frame that begins anew.
}

TEST_CASE(
    "a server whose renderer blocks answers heartbeats, is seen to be stuck, and the frame is finished") {
    const SmallJob small(16);
    const TemporaryFolder cache;
    std::atomic<int> rounds{0};
    Gate gate;
    ServerConfig config;
    config.before_round = [&] {
        if (rounds.fetch_add(1) >= 3) gate.pass();
    };
    EventStore store;
    const auto client = std::move(*ClientSession::create(listening(1), small.job(), store));
    {
        const RunningServer server(ports_of(client->endpoints()), cache.path(), 0, config);
        const TimeNs begun = monotonic_now();
        CHECK(finish(*client));  // By the client alone.
        CHECK(monotonic_now() - begun > ProgressWatch::k_least_patience);
        CHECK(store.total(Counter::stuck) >= 1);
        CHECK(store.total(Counter::died) == 0);
        CHECK(client->progress().servers_ready == 0);
        gate.open();
        CHECK(step_until(*client, [&] { return client->progress().servers_ready == 1; }));
    }
    CHECK(hash_of(*client) == small.hash_of_one_machine());
    CHECK(store.server(k_local_server)->total(Counter::rounds_committed) > 0);
    CHECK(bool(client->work().indirect_ledger().check_invariants()));
}
