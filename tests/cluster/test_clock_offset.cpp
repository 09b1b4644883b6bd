#include "pathscope/cluster/clock_offset.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

/// An exchange at client time `now` with a server whose clock is ahead by `ahead`.
ClockExchange exchange(TimeNs now, TimeNs ahead, TimeNs there, TimeNs thinks, TimeNs back) {
    return {now, now + there + ahead, now + there + thinks + ahead, now + there + thinks + back};
}

}  // namespace

TEST_CASE("without an exchange there is no estimate") { CHECK_FALSE(ClockEstimate{}.at(0).has_value()); }

TEST_CASE("equal ways give the offset exactly, whatever the server thinks in between") {
    for (const TimeNs ahead : {TimeNs{0}, 5 * k_second_ns, -3600 * k_second_ns}) {
        ClockEstimate estimate;
        CHECK(*estimate.add(exchange(1000, ahead, 200, 7'000'000, 200)) == 400);
        const ClockOffset offset = *estimate.at(1000);
        CHECK(offset.offset == ahead);
        CHECK(offset.rtt == 400);
        CHECK(offset.to_client(1000 + ahead) == 1000);
    }
}

TEST_CASE("unequal ways are off by half their difference, which the error band covers") {
    ClockEstimate estimate;
    estimate.add(exchange(0, 1'000'000, 900'000, 0, 100'000));
    const ClockOffset offset = *estimate.at(1'000'000);
    CHECK(offset.offset == 1'000'000 + 400'000);
    CHECK(std::abs(offset.offset - 1'000'000) <= offset.error);
    CHECK(offset.error < 501'000);
}

TEST_CASE(
    "the truth lies within the band through queues, jitter and drift; the band is that of the best "
    "exchange") {
    for (std::uint32_t seed = 0; seed < 100; ++seed) {
        HashRng rng(seed);
        const double drift = (2 * rng.next_float() - 1) * 50e-6;  // two ordinary quartz clocks
        const auto ahead_at = [&](TimeNs now) {
            return 77 * k_second_ns + static_cast<TimeNs>(drift * double(now));
        };
        const auto way = [&] { return 100'000 + static_cast<TimeNs>(-5e6 * std::log(1 - rng.next_float())); };
        ClockEstimate estimate;
        TimeNs shortest = k_second_ns;
        for (TimeNs now = 0; now < 60 * k_second_ns; now += k_second_ns / 4) {
            const TimeNs rtt = *estimate.add(exchange(now, ahead_at(now), way(), 50'000, way()));
            if (now > 50 * k_second_ns) shortest = std::min(shortest, rtt);
            const ClockOffset offset = *estimate.at(now + k_second_ns / 4);
            CHECK(std::abs(offset.offset - ahead_at(now)) <= offset.error);
        }
        const ClockOffset offset = *estimate.at(60 * k_second_ns);
        CHECK(offset.error <= shortest / 2 + static_cast<TimeNs>(1e-4 * 10e9) + 3);
    }
}

TEST_CASE("an old exchange loses to a newer one that is a little longer") {
    ClockEstimate estimate;
    estimate.add(exchange(0, 0, 100'000, 0, 100'000));
    estimate.add(exchange(100 * k_second_ns, 5'000'000, 150'000, 0, 150'000));
    CHECK(estimate.at(100 * k_second_ns)->offset == 5'000'000);
}

TEST_CASE("impossible exchanges are refused, and cannot overflow") {
    ClockEstimate estimate;
    CHECK_FALSE(estimate.add({100, 0, 0, 50}).has_value());    // came back before it went
    CHECK_FALSE(estimate.add({0, 100, 50, 200}).has_value());  // answered before received
    CHECK_FALSE(estimate.add({0, 0, 500, 100}).has_value());   // thought for longer than it was away
    constexpr TimeNs k_low = std::numeric_limits<TimeNs>::min(), k_high = std::numeric_limits<TimeNs>::max();
    CHECK_FALSE(estimate.add({0, k_low, k_high, 1}).has_value());
    CHECK_FALSE(estimate.add({0, k_high, k_high, 1}).has_value());
    CHECK_FALSE(estimate.at(0).has_value());
    const TimeNs huge = TimeNs{1} << 61;
    CHECK(estimate.add({-huge, huge, huge, -huge}).has_value());
    CHECK(estimate.at(0)->offset == 2 * huge);
}

TEST_CASE(
    "a moment that is plausible can be moved to the client's time line, and a plausible span added to it") {
    const TimeNs huge = TimeNs{1} << 61;
    CHECK(is_plausible(0));
    CHECK(is_plausible(huge));
    CHECK(is_plausible(-huge));
    CHECK_FALSE(is_plausible(huge + 1));
    CHECK_FALSE(is_plausible(std::numeric_limits<TimeNs>::max()));
    CHECK_FALSE(is_plausible(std::numeric_limits<TimeNs>::min()));
    ClockEstimate estimate;  // A server whose clock stands at zero, and a client that runs for 73 years.
    REQUIRE(estimate.add({huge - 100, 0, 0, huge}).has_value());
    const TimeNs moved = estimate.at(huge)->to_client(huge);
    CHECK(moved == 2 * huge - 50);
    CHECK(std::numeric_limits<TimeNs>::max() - moved > huge);
}
