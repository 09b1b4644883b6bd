/// Ghosts over real sockets on loopback: what they are asked for is answered, in size, number and time.

#include "pathscope/session/ghost_host.hpp"

#include <cmath>
#include <numeric>
#include <thread>

#include "pathscope/session/client_session.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr TimeNs k_patience = 120 * k_second_ns;  ///< A test that waits longer has failed.

/// Indirect light alone, of a scene that nobody looks at.
ClientJob ghost_job(std::uint32_t spp) {
    const SceneFile file = *parse_scene_file(
        R"({"name": "ghosts", "obj": "ghosts.obj", "up_axis": "Y",
            "camera": {"position": [0, 0, 4], "look_at": [0, 0, 0], "up": [0, 1, 0], "vfov_deg": 40},
            "lights": [{"type": "sphere", "centre": [0, 0, 0], "radius": 1, "radiance": [1, 1, 1]}]})",
        "ghosts.json");
    RenderState state;
    state.scene = file;
    state.camera = file.cameras.front().view;
    state.settings.width = 70;
    state.settings.height = 40;
    state.settings.spp = spp;
    state.settings.direct_spp = 0;
    return {state, std::make_shared<const Scene>(), SceneDepot()};
}

ClientConfig listening(int min_servers) {
    ClientConfig config;
    config.any_ports = true;
    config.listens = true;
    config.min_servers = min_servers;
    config.threads = 1;
    config.block_size = 16;
    config.round_samples = 2;
    config.detector = DetectorKind::fixed;  // Patient: no server is given up because the machine is busy.
    return config;
}

/// A host on a thread of its own; it is told to stop at the end of the scope.
class RunningHost {
  public:
    RunningHost(const ClientSession& client, int count, double samples_per_second) {
        GhostConfig config;
        for (std::size_t i = 0; i < config.ports.size(); ++i)
            config.ports[i] = std::stoi(client.endpoints()[i].substr(client.endpoints()[i].rfind(':') + 1));
        config.count = count;
        config.speed = {samples_per_second, 0};
        host_ = std::move(*GhostHost::create(config));
        thread_ = std::thread([this] { result_ = host_->run(); });
    }
    ~RunningHost() {
        host_->request_stop();
        thread_.join();
        CHECK(bool(result_));
    }

  private:
    std::unique_ptr<GhostHost> host_;
    std::thread thread_;
    Result<void> result_;
};

bool finish(ClientSession& client) {
    for (const TimeNs limit = monotonic_now() + k_patience; !client.complete();
         client.step(50 * k_millisecond_ns))
        if (monotonic_now() > limit) return false;
    return true;
}

}  // namespace

TEST_CASE("speeds of ghosts are written as they are read, and others are refused in a sentence") {
    for (const GhostSpeed& speed : {GhostSpeed{1000, 0}, GhostSpeed{2.5e6, 0.4}, GhostSpeed{1, 2}})
        CHECK(*parse_ghost_speed(to_text(speed)) == speed);
    CHECK(*parse_ghost_speed("2e5,lognormal:0.4") == GhostSpeed{2e5, 0.4});
    for (const char* bad :
         {"", "0", "-1", "nan", "1e13", "fast", "1000,", "1000,0.4", "1000,normal:0.4",
          "1000,lognormal:", "1000,lognormal:3", "1000,lognormal:-1", "1000 ", ",lognormal:0.4"}) {
        CAPTURE(bad);
        const auto speed = parse_ghost_speed(bad);
        REQUIRE_FALSE(speed);
        CHECK(speed.error().message.find(bad) != std::string::npos);
    }
}

TEST_CASE("ghosts are alike, or lognormal around the median, and the same for any number of them") {
    CHECK(ghost_speeds({5000, 0}, 3, 1) == std::vector<double>{5000, 5000, 5000});
    constexpr int k_count = 10'000;
    constexpr double k_sigma = 0.4;
    const std::vector<double> speeds = ghost_speeds({5000, k_sigma}, k_count, 1);
    double mean = 0, square = 0;
    for (const double speed : speeds) {
        const double z = std::log(speed / 5000) / k_sigma;
        mean += z / k_count;
        square += z * z / k_count;
    }
    CHECK(std::abs(mean) < 4 / std::sqrt(k_count));  // Four standard errors: 1 in 16,000 seeds would fail.
    CHECK(std::abs(square - 1) < 4 * std::sqrt(2.0 / k_count));
    const std::vector<double> few = ghost_speeds({5000, k_sigma}, 10, 1);
    CHECK(std::equal(few.begin(), few.end(), speeds.begin()));
    CHECK(ghost_speeds({5000, k_sigma}, 10, 2) != few);
}

TEST_CASE("ghosts complete a frame, each round counted once, and the next one of another state") {
    constexpr int k_ghosts = 5;
    EventStore store;
    auto client = ClientSession::create(listening(k_ghosts), ghost_job(8), store);
    REQUIRE(bool(client));
    const RunningHost host(**client, k_ghosts, 1e9);
    REQUIRE(finish(**client));
    constexpr std::uint64_t k_rounds = 5 * 3 * 4;  // 70x40 in blocks of 16, 8 samples in rounds of 2.
    CHECK((*client)->work().indirect_ledger().rounds_committed() == k_rounds);
    CHECK((*client)->work().indirect_ledger().check_invariants());
    CHECK(store.total(Counter::rounds_committed) == k_rounds);
    CHECK(store.total(Counter::samples) == 70 * 40 * 8);
    CHECK(store.total(Counter::bad_messages) == 0);
    CHECK(store.total(Counter::died) == 0);
    CHECK(store.total(Counter::servers_joined) == k_ghosts);
    CHECK((*client)->progress().servers_ready == k_ghosts);
    for (int y = 0; y < 40; ++y)  // Somebody answered for each pixel.
        for (int x = 0; x < 70; ++x) CHECK((*client)->work().indirect().sum_at(x, y) != PixelSum{});

    // Without an INPUT socket: PING tells them that they are behind.
    RenderState state = (*client)->state();
    state.settings.width = 33;
    state.settings.seed = 2;
    (*client)->change_state(state);
    REQUIRE(finish(**client));
    CHECK((*client)->work().indirect_ledger().rounds_committed() == 3 * 3 * 4);
    CHECK((*client)->work().indirect_ledger().check_invariants());
    CHECK(store.total(Counter::bad_messages) == 0);
}

TEST_CASE("a ghost takes as long as a machine of its speed") {
    constexpr double k_seconds = 0.6;
    EventStore store;
    auto client = ClientSession::create(listening(2), ghost_job(8), store);
    REQUIRE(bool(client));
    const RunningHost host(**client, 2, 70 * 40 * 8 / (2 * k_seconds));
    while ((*client)->progress().waiting) (*client)->step(k_millisecond_ns);
    const TimeNs begun = monotonic_now();
    REQUIRE(finish(**client));
    // It cannot be quicker, but for the moment that work was handed out before this looked at the clock.
    CHECK(to_seconds(monotonic_now() - begun) > 0.9 * k_seconds);
}

TEST_CASE("ghosts whose client leaves serve the next one") {
    ClientConfig config = listening(3);
    std::optional<RunningHost> host;
    for (int run = 0; run < 2; ++run) {
        CAPTURE(run);
        EventStore store;
        auto client = ClientSession::create(config, ghost_job(2), store);
        REQUIRE(bool(client));
        if (run == 0) {
            host.emplace(**client, 3, 1e9);
            for (std::size_t i = 0; i < config.ports.size(); ++i)
                config.ports[i] =
                    std::stoi((*client)->endpoints()[i].substr((*client)->endpoints()[i].rfind(':') + 1));
            config.any_ports = false;
        }
        REQUIRE(finish(**client));
        CHECK(store.total(Counter::servers_joined) == 3);
    }
}
