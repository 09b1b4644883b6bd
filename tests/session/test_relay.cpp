/// Relays over real sockets on loopback, in one process: the image has the same bits as the render of one machine.

#include <functional>
#include <thread>

#include "pathscope/session/ghost_host.hpp"
#include "pathscope/session/relay_session.hpp"
#include "pathscope/session/server_session.hpp"

#include "small_job.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

ClientConfig listening() {
    ClientConfig config;
    config.any_ports = config.listens = true;
    config.min_servers = 1;
    config.threads = 1;
    config.block_size = 16;
    config.round_samples = 8;
    config.detector = DetectorKind::fixed;  // Patient: no server is given up because the machine is busy.
    return config;
}

/// A session on a thread of its own; it is told to stop at the end of the scope.
template <class Session>
class Running {
  public:
    explicit Running(Result<std::unique_ptr<Session>> session) : session_(std::move(*session)) {
        thread_ = std::thread([this] { result_ = session_->run(); });
    }
    ~Running() {
        session_->request_stop();
        thread_.join();
        CHECK(bool(result_));
    }
    [[nodiscard]] Session& session() { return *session_; }

  private:
    std::unique_ptr<Session> session_;
    std::thread thread_;
    Result<void> result_;
};

std::unique_ptr<Running<RelaySession>> start_relay(std::array<int, 3> ports,
                                                   const std::filesystem::path& cache) {
    RelayConfig config;
    config.client.ports = ports;
    config.client.name = "relay";
    config.cache_folder = cache;
    config.below.any_ports = true;
    config.below.detector = DetectorKind::fixed;
    return std::make_unique<Running<RelaySession>>(RelaySession::create(config));
}

std::unique_ptr<Running<ServerSession>> start_server(std::array<int, 3> ports,
                                                     const std::filesystem::path& cache) {
    ServerConfig config;
    config.ports = ports;
    config.name = "server";
    config.threads = 1;
    config.cache_folder = cache;
    return std::make_unique<Running<ServerSession>>(ServerSession::create(config));
}

}  // namespace

TEST_CASE("behind a relay, and behind a relay of relays, the image has the same bits") {
    const SmallJob small(24);
    const TemporaryFolder relays_cache, servers_cache;
    EventStore store;
    const auto client = std::move(*ClientSession::create(listening(), small.job(), store));
    const auto top = start_relay(ports_of(client->endpoints()), relays_cache.path());
    const auto low = start_relay(ports_of(top->session().endpoints()), relays_cache.path());
    const auto near = start_server(ports_of(top->session().endpoints()), servers_cache.path());
    const auto far = start_server(ports_of(low->session().endpoints()), servers_cache.path());
    REQUIRE(finish(*client));
    CHECK(hash_of(*client) == small.hash_of_one_machine(small.state));
    CHECK(store.total(Counter::servers_joined) == 1);
    CHECK(store.total(Counter::samples) == 70 * 40 * 26);
    CHECK(store.total(Counter::bad_messages) == 0);

    // Another camera, and light that loses bits on its way: as of one server that renders whole leases.
    RenderState next = small.state;
    next.camera.position.x += 0.1f;
    client->change_state(next);
    REQUIRE(finish(*client));
    CHECK(hash_of(*client) == small.hash_of_one_machine(next));
}

TEST_CASE("with a wire that loses bits, a relay's tiles are those of a server") {
    const SmallJob small(24);
    const TemporaryFolder cache;
    const auto render = [&](bool relayed) {
        EventStore store;
        ClientJob job = small.job();
        job.state.settings.wire = WireFormat::half;
        ClientConfig config = listening();
        config.lease_time = 0;  // What is rounded is a lease's light: leases must be alike.
        const auto client = std::move(*ClientSession::create(config, job, store));
        std::array<int, 3> ports = ports_of(client->endpoints());
        std::unique_ptr<Running<RelaySession>> relay;
        if (relayed) relay = start_relay(ports, cache.path());
        if (relayed) ports = ports_of(relay->session().endpoints());
        const auto a = start_server(ports, cache.path());
        const auto b = start_server(ports, cache.path());
        REQUIRE(finish(*client));
        return hash_of(*client);
    };
    CHECK(render(true) == render(false));
}

TEST_CASE("ghosts behind a relay: the client sees one server, and a tile for each of its leases") {
    const SmallJob small(24);
    const TemporaryFolder cache;
    EventStore store;
    ClientConfig config = listening();
    config.lease_time = 0;
    ClientJob job = small.job();
    job.state.settings.direct_spp = 0;
    const auto client = std::move(*ClientSession::create(config, job, store));
    const auto relay = start_relay(ports_of(client->endpoints()), cache.path());
    GhostConfig ghosts;
    ghosts.ports = ports_of(relay->session().endpoints());
    ghosts.count = 20;
    ghosts.speed = {1e6, 0};
    const Running<GhostHost> host(GhostHost::create(ghosts));
    REQUIRE(finish(*client));
    CHECK(store.total(Counter::servers_joined) == 1);
    CHECK(store.total(Counter::tiles) == 5 * 3 * 3);  // 70x40 in blocks of 16, 24 samples in rounds of 8.
    CHECK(store.total(Counter::samples) == 70 * 40 * 24);
    CHECK(store.total(Counter::died) == 0);
}
