#include "pathscope/cluster/progress_watch.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

constexpr TimeNs k_beat = 250 * k_millisecond_ns;

/// A server that beats, and what its client thinks.
struct Beating {
    explicit Beating(TimeNs interval = k_beat) : heartbeat(interval), watch(interval) {
        watch.on_heartbeat(counter, 0, now);
    }

    /// Beats for so long; each time its counter rises by `gain`.
    void beat_for(TimeNs duration, std::uint32_t leases, std::uint64_t gain) {
        for (const TimeNs end = now + duration; now < end;) {
            now += heartbeat;
            counter += gain;
            watch.on_heartbeat(counter, leases, now);
        }
    }

    TimeNs heartbeat;
    TimeNs now = 17 * k_second_ns;
    std::uint64_t counter = 0;
    ProgressWatch watch;
};

}  // namespace

TEST_CASE("a server is stuck after five seconds in which it held leases and its counter stood still") {
    Beating server;
    server.beat_for(4'750 * k_millisecond_ns, 2, 0);
    CHECK(!server.watch.stuck(0));
    CHECK(server.watch.still() == 4'750 * k_millisecond_ns);
    server.beat_for(k_beat, 2, 0);
    CHECK(server.watch.stuck(0));
    CHECK(server.watch.still() == 5 * k_second_ns);
}

TEST_CASE("it is not any more when the counter rises, or when it holds no lease") {
    for (const bool moves : {true, false}) {
        Beating server;
        server.beat_for(8 * k_second_ns, 1, 0);
        REQUIRE(server.watch.stuck(0));
        server.beat_for(k_beat, moves ? 1 : 0, moves ? 1 : 0);
        CHECK(!server.watch.stuck(0));
        server.beat_for(4 * k_second_ns, 1, 0);
        CHECK(!server.watch.stuck(0));
    }
}

TEST_CASE("neither a slow server nor an idle one is stuck, however long it takes") {
    Beating slow;
    slow.beat_for(3600 * k_second_ns, 2, 1);
    CHECK(slow.watch.still() == 0);
    Beating idle;
    idle.beat_for(3600 * k_second_ns, 0, 0);
    CHECK(idle.watch.still() == 0);
}

TEST_CASE("a server that counts finished rounds only is judged by how long its rounds take") {
    Beating server;
    server.beat_for(12 * k_second_ns, 2, 0);
    CHECK(server.watch.stuck(0));
    CHECK(server.watch.stuck(3 * k_second_ns));
    CHECK(!server.watch.stuck(3 * k_second_ns + 1));
}

TEST_CASE("time in which it did not beat is not held against it") {
    Beating server;
    server.beat_for(k_beat, 1, 0);
    server.now += 60 * k_second_ns;  // Its machine slept.
    server.beat_for(k_beat, 1, 0);
    CHECK(server.watch.still() == 3 * k_beat);
    CHECK(!server.watch.stuck(0));
    // What waited in between comes all at once.
    for (int i = 0; i < 100; ++i) server.watch.on_heartbeat(0, 1, server.now);
    CHECK(server.watch.still() == 3 * k_beat);
}

TEST_CASE("with heartbeats six seconds apart it takes three of them") {
    Beating server(6 * k_second_ns);
    server.beat_for(12 * k_second_ns, 1, 0);
    CHECK(!server.watch.stuck(0));
    server.beat_for(6 * k_second_ns, 1, 0);
    CHECK(server.watch.stuck(0));
}

TEST_CASE("an old message that comes again does not count as progress") {
    Beating server;
    server.beat_for(k_second_ns, 1, 5);
    for (int i = 0; i < 30; ++i) {
        server.watch.on_heartbeat(5, 1, server.now);
        server.beat_for(k_beat, 1, 0);
    }
    CHECK(server.watch.stuck(0));
}
