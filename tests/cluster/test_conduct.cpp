#include "pathscope/cluster/conduct.hpp"

#include <fmt/format.h>

#include "testing.hpp"

using namespace pathscope;

namespace {

constexpr TimeNs k_start = 1'000 * k_second_ns;

/// Offends at once until banned; the ban.
Ban offend_until_banned(Conduct& conduct, const std::string& who, TimeNs now) {
    for (int i = 0; i < 1'000; ++i)
        if (const auto ban = conduct.report(who, Offence::malformed, now)) return *ban;
    FAIL("never banned");
    return {};
}

}  // namespace

TEST_CASE("offences have names and a price") {
    for (const auto& [offence, name] : k_offence_names) {
        CHECK(from_name<Offence>(name) == offence);
        CHECK(points_of(offence) > 0);
    }
    CHECK(points_of(Offence::corrupt) > points_of(Offence::malformed));
}

TEST_CASE("points add up and halve every half-life") {
    Conduct conduct;
    const TimeNs half_life = ConductParams{}.half_life;
    CHECK(conduct.points("a", k_start) == 0);
    CHECK_FALSE(conduct.report("a", Offence::corrupt, k_start));
    CHECK_FALSE(conduct.report("a", Offence::corrupt, k_start));
    CHECK(conduct.points("a", k_start) == doctest::Approx(8));
    CHECK(conduct.points("a", k_start + half_life) == doctest::Approx(4));
    CHECK(conduct.points("a", k_start + 3 * half_life) == doctest::Approx(1));
    CHECK_FALSE(conduct.report("a", Offence::corrupt, k_start + half_life));
    CHECK(conduct.points("a", k_start + half_life) == doctest::Approx(8));
    CHECK(conduct.points("b", k_start) == 0);
}

TEST_CASE(
    "now and then is forgiven for ever, often is a ban: the limit is where points balance their decay") {
    // One point every T: the sum tends to 1 / (1 - 2^(-T/half_life)), which is below 10 for T > 0.152 half_life.
    const TimeNs half_life = ConductParams{}.half_life;
    for (const bool often : {false, true}) {
        Conduct conduct;
        bool banned = false;
        TimeNs now = k_start;
        for (int i = 0; i < 5'000; ++i, now += TimeNs(double(half_life) * (often ? 0.145 : 0.16)))
            banned = banned || conduct.report("a", Offence::malformed, now);
        CHECK(banned == often);
    }
}

TEST_CASE("a ban comes at the tenth point, has an end, and is told once") {
    Conduct conduct;
    for (int i = 0; i < 9; ++i) CHECK_FALSE(conduct.report("a", Offence::malformed, k_start));
    CHECK_FALSE(conduct.ban_of("a", k_start));
    const auto ban = conduct.report("a", Offence::misplaced, k_start);
    REQUIRE(ban);
    CHECK(ban->until == k_start + 30 * k_second_ns);
    CHECK(ban->times == 1);
    CHECK(ban_sentence(*ban, k_start + 1) ==
          "It misbehaved too often (last: misplaced) and may come back in 30 s.");
    CHECK_FALSE(conduct.report("a", Offence::corrupt, k_start + k_second_ns));  // Not heard, so nothing more.
    CHECK(conduct.ban_of("a", ban->until - 1));
    CHECK_FALSE(conduct.ban_of("a", ban->until));
    CHECK_FALSE(conduct.ban_of("b", k_start));
    CHECK(conduct.points("a", ban->until) == 0);  // It begins anew.
}

TEST_CASE("bans grow with each repeat up to a limit, and good conduct is remembered too") {
    Conduct conduct;
    TimeNs now = k_start;
    for (const int seconds : {30, 120, 480, 1920, 3600, 3600}) {
        const Ban ban = offend_until_banned(conduct, "a", now);
        CHECK(ban.until - now == seconds * k_second_ns);
        now = ban.until;
    }
    // Six bans; four are forgiven after four times ten minutes, so the next is the third.
    now += 4 * ConductParams{}.forgive_after;
    CHECK(offend_until_banned(conduct, "a", now).times == 3);
    now += 100'000 * k_second_ns;
    CHECK(offend_until_banned(conduct, "a", now).times == 1);
}

TEST_CASE("a flood is stopped at the allowance; others have their own") {
    ConductParams params;
    params.strangers = {100, 50};
    Conduct conduct(params);
    int heard = 0;
    for (int i = 0; i < 10'000; ++i) heard += conduct.may_send("a", k_start + i * 100 * k_microsecond_ns);
    CHECK(heard >= 149);  // 50 at once, 100 in the one second.
    CHECK(heard <= 150);
    CHECK(conduct.may_send("b", k_start + k_second_ns));
}

TEST_CASE("memory is bounded, and newcomers do not wash away bans") {
    Conduct conduct;
    offend_until_banned(conduct, "banned", k_start);
    conduct.report("offender", Offence::corrupt, k_start);
    for (int i = 0; i < 10'000; ++i)
        conduct.report(fmt::format("new {}", i), Offence::unknown_type, k_start + i);
    CHECK(conduct.remembered() == Conduct::k_max_peers);
    CHECK(conduct.ban_of("banned", k_start + k_second_ns));
    CHECK(conduct.points("offender", k_start) > 0);
    // When all are banned, the ban that ends first goes, and the newest offender is still judged.
    for (int i = 0; i < 9'000; ++i)
        offend_until_banned(conduct, fmt::format("bad {}", i), k_start + 2 * k_second_ns);
    CHECK(conduct.remembered() == Conduct::k_max_peers);
}

TEST_CASE("a peer is known by its key, else by machine and name; the kinds cannot be confused") {
    CHECK(conduct_name("K", "n", "10.0.0.1") == conduct_name("K", "other", "10.0.0.2"));
    CHECK(conduct_name("", "n", "10.0.0.1") != conduct_name("", "n", "10.0.0.2"));
    CHECK(conduct_name("", "n", "10.0.0.1") != conduct_name("", "m", "10.0.0.1"));
    CHECK(conduct_name("", "", "10.0.0.1") != conduct_name("", "n", "10.0.0.1"));
    CHECK(conduct_name("K", "", "") != conduct_name("", "K", ""));
}
