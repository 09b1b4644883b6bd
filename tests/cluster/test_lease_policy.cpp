#include "pathscope/cluster/lease_policy.hpp"

#include <cmath>
#include <limits>

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("a lease is four times the prediction, between half a second and six, and never below twice") {
    CHECK(lease_duration(0, 0) == k_second_ns / 2);
    CHECK(lease_duration(100 * k_millisecond_ns, 0) == k_second_ns / 2);
    CHECK(lease_duration(200 * k_millisecond_ns, 0) == 800 * k_millisecond_ns);
    CHECK(lease_duration(k_second_ns, 0) == 4 * k_second_ns);
    CHECK(lease_duration(2 * k_second_ns, 0) == 6 * k_second_ns);
    CHECK(lease_duration(10 * k_second_ns, 0) == 20 * k_second_ns);
    CHECK(lease_duration(std::nullopt, 0) == 6 * k_second_ns);
}

TEST_CASE("each attempt doubles it, up to a limit, and nothing overflows") {
    CHECK(lease_duration(k_second_ns, 1) == 8 * k_second_ns);
    CHECK(lease_duration(k_second_ns, 3) == 32 * k_second_ns);

    CHECK(lease_duration(k_second_ns, 4'000'000'000u) == 32 * k_second_ns);
    CHECK(lease_duration(std::numeric_limits<TimeNs>::max(), 6) == 3600 * k_second_ns);
    CHECK(lease_duration(-5, 0) == k_second_ns / 2);
}

TEST_CASE("speed is measured from results, forgets slowly, and ignores nonsense") {
    SpeedEstimate speed;
    CHECK_FALSE(speed.measured());
    CHECK_FALSE(speed.predict(10).has_value());
    speed.add(0, k_second_ns);
    speed.add(std::nan(""), k_second_ns);
    speed.add(100, 0);
    speed.add(100, -5);
    CHECK_FALSE(speed.measured());

    speed.add(1000, k_second_ns);
    CHECK(speed.per_second() == doctest::Approx(1000));
    CHECK(to_seconds(*speed.predict(500)) == doctest::Approx(0.5));
    speed.add(500, k_second_ns);  // 1 ms then 2 ms for each: the mean is 1.25 ms
    CHECK(to_seconds(*speed.predict(1000)) == doctest::Approx(1.25));
    for (int i = 0; i < 50; ++i) speed.add(500, k_second_ns);
    CHECK(speed.per_second() == doctest::Approx(500).epsilon(1e-4));
    CHECK(*speed.predict(1e300) == 3600 * k_second_ns);
}

TEST_CASE("a turnaround is a mean that forgets by a quarter each time") {
    Turnaround turnaround;
    CHECK(turnaround.mean() == 0);
    turnaround.add(800);
    CHECK(turnaround.mean() == 800);
    turnaround.add(400);
    CHECK(turnaround.mean() == 700);
    turnaround.add(0);
    CHECK(turnaround.mean() == 525);
}

TEST_CASE("an idle server saves the leases in front, but neither the wire nor the client's own delays") {
    Turnaround turnaround;
    CHECK(turnaround.when_idle(10, 3) == 10);  // Not measured.
    turnaround.add(100);
    CHECK(turnaround.when_idle(10, 1) == 100);
    CHECK(turnaround.when_idle(10, 3) == 80);   // 20 of it for the two in front.
    CHECK(turnaround.when_idle(0, 64) == 100);  // Nothing but delays.
    CHECK(turnaround.when_idle(40, 3) == 40);   // Never less than rendering takes.
}
