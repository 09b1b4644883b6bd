#include "pathscope/session/relay_work.hpp"

#include <set>

#include "pathscope/math/random.hpp"
#include "pathscope/protocol/strategy.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr ServerId k_a{1}, k_b{2};
const auto k_a_second = [](const Round&, std::uint32_t) { return k_second_ns; };
IndirectWork::OwnTime takes(TimeNs time) {
    return [time](double) { return std::optional(time); };
}

/// A lease of the client above; its light is that of `flat`, which can be worked out for any part of it.
RoundJob lease_of(std::uint64_t ticket, std::uint32_t first, std::uint32_t count) {
    RoundJob job;
    job.ticket = ticket;
    job.round = {7, {8, 16, 4, 2}, first, count};
    return job;
}

ResultClaim claim_of(const Lease& lease) {
    return {lease.id, lease.epoch, lease.unit, lease.first, lease.count, lease.server};
}

/// What a server gives for a lease: one ray a sample, and a dropped sample in each round.
Commit answer(RelayWork& work, const Lease& lease, TimeNs now, TimeNs took = 10 * k_millisecond_ns) {
    const PixelRect rect{8, 16, 4, 2};
    RoundResult result;
    result.samples = result.rays = std::uint64_t(rect.area()) * lease.count;
    result.dropped = {{8, 16, lease.first}};
    result.dropped_count = result.saturated_count = 1;
    return work.commit_indirect(claim_of(lease), result, flat_sums(rect, lease.first, lease.count), took,
                                now);
}

}  // namespace

TEST_CASE("the tile of a lease is the sum of its rounds, in whatever order they come") {
    RelayWork work;
    work.set_servers({{k_a, 0}, {k_b, 0}});
    work.begin(lease_of(5, 100, 10), 0);
    CHECK(work.rounds_open() == 3);  // 4, 4 and 2, before any speed is known; spread evenly: 4, 4, 2.
    std::vector<Lease> leases;
    while (const auto lease = work.grant_indirect(leases.size() % 2 ? k_a : k_b, 0, 1, k_a_second)) {
        CHECK(work.round_of(*lease).rect == PixelRect{8, 16, 4, 2});
        CHECK(lease->unit == 7);
        leases.push_back(*lease);
    }
    REQUIRE(leases.size() == 3);
    CHECK(leases.front().first == 100);
    CHECK(leases.back().first + leases.back().count == 110);
    CHECK(work.outstanding() == 3);
    for (const std::size_t i : {2u, 0u, 1u}) {
        CHECK(work.take_finished().empty());
        CHECK(bool(work.check_invariants()));
        CHECK(work.judge(claim_of(leases[i])) == Verdict::accepted);
        CHECK(answer(work, leases[i], k_second_ns / 2).verdict == Verdict::accepted);
    }
    const auto finished = work.take_finished();
    REQUIRE(finished.size() == 1);
    const RoundOutcome& outcome = finished.front();
    CHECK(outcome.ticket == 5);
    CHECK(outcome.round == lease_of(5, 100, 10).round);
    REQUIRE(outcome.result.has_value());
    CHECK(outcome.result->sums == flat_sums({8, 16, 4, 2}, 100, 10));
    CHECK(outcome.result->samples == 80);
    CHECK(outcome.result->rays == 80);
    CHECK(outcome.result->dropped_count == 3);
    CHECK(outcome.result->saturated_count == 3);
    CHECK(outcome.result->dropped.size() == 3);
    // Three rounds of 10 ms by two servers: together they need 15 ms for it.
    CHECK(outcome.duration == 15 * k_millisecond_ns);
    CHECK(work.leases() == 0);
    CHECK(answer(work, leases[0], k_second_ns).verdict == Verdict::duplicate);
}

TEST_CASE("a round that is lost, late or copied is in the sum once") {
    RelayWork work;
    work.set_servers({{k_a, 0}, {k_b, 0}});
    work.begin(lease_of(1, 0, 12), 0);
    const Lease lost = *work.grant_indirect(k_a, 0, 1, k_a_second);
    const Lease late = *work.grant_indirect(k_a, 0, 1, k_a_second);
    CHECK(work.revoke(k_a, 1) == 2);
    CHECK(work.any_reopened());
    const Lease again = *work.grant_indirect(k_b, 1, 1, k_a_second);
    CHECK(again.first == lost.first);
    CHECK(answer(work, late, 2).late);
    CHECK_FALSE(work.any_reopened());
    const Lease last = *work.grant_indirect(k_b, 2, 1, k_a_second);
    CHECK_FALSE(work.grant_indirect(k_b, 2, 1, k_a_second).has_value());
    const Lease copy = *work.copy_straggler(k_a, 2 + k_second_ns / 2, takes(k_second_ns / 10), k_a_second);
    CHECK(copy.first == again.first);
    const Commit won = answer(work, copy, k_second_ns / 2);
    REQUIRE(won.superseded.size() == 1);
    CHECK(won.superseded.front().id == again.id);
    CHECK(answer(work, again, k_second_ns / 2).verdict == Verdict::duplicate);
    work.expire(10 * k_second_ns);
    CHECK(answer(work, last, 10 * k_second_ns).late);
    const auto finished = work.take_finished();
    REQUIRE(finished.size() == 1);
    CHECK(finished.front().result->sums == flat_sums({8, 16, 4, 2}, 0, 12));
}

TEST_CASE(
    "a server that gives every lease back fills no memory, and is not believed if a result comes all the "
    "same") {
    RelayWork work;
    work.begin(lease_of(1, 0, 8), 0);
    for (int i = 0; i < 1000; ++i) {
        const Lease lease = *work.grant_indirect(k_a, i, 1, k_a_second);
        work.release(lease.id, k_b, i);  // Not its own to give back.
        CHECK(work.numbers_known() == 1);
        work.release(lease.id, k_a, i);
        CHECK(work.numbers_known() == 0);
        CHECK(work.judge(claim_of(lease)) == Verdict::duplicate);
        REQUIRE(bool(work.check_invariants()));
    }
    CHECK(work.has_begun(1));
}

TEST_CASE("what a result may weigh is told by the largest lease so far, not by the relay's own settings") {
    RelayWork work;
    CHECK(work.most_pixels() == 0);
    RoundJob large = lease_of(1, 0, 8);
    large.round.rect = {0, 0, 64, 48};
    work.begin(large, 0);
    work.begin(lease_of(2, 0, 8), 0);
    CHECK(work.most_pixels() == 64 * 48);
}

TEST_CASE("what does not fit its lease is not booked") {
    RelayWork work;
    work.begin(lease_of(1, 50, 8), 0);
    const Lease lease = *work.grant_indirect(k_a, 0, 1, k_a_second);
    const auto judge_with = [&](auto&& change) {
        ResultClaim claim = claim_of(lease);
        change(claim);
        return work.judge(claim);
    };
    CHECK(judge_with([](auto& claim) { claim.unit = 0; }) == Verdict::mismatched);
    CHECK(judge_with([](auto& claim) { claim.first = 0; }) == Verdict::mismatched);
    CHECK(judge_with([](auto& claim) { ++claim.count; }) == Verdict::mismatched);
    CHECK(judge_with([](auto& claim) { claim.server = k_b; }) == Verdict::mismatched);
    CHECK(judge_with([](auto& claim) { ++claim.epoch.value; }) == Verdict::unknown);
    CHECK(judge_with([](auto& claim) { claim.epoch.value = 0; }) == Verdict::stale_epoch);
    CHECK(judge_with([](auto& claim) { claim.lease.value = 99; }) == Verdict::unknown);
    CHECK(judge_with([](auto& claim) { claim.lease.value = 0; }) == Verdict::unknown);
    CHECK(judge_with([](auto&) {}) == Verdict::accepted);
}

TEST_CASE("a lease that is taken back, and all of an epoch, end without a result") {
    RelayWork work;
    work.begin(lease_of(1, 0, 8), 0);
    work.begin(lease_of(2, 8, 8), 0);
    CHECK_FALSE(work.has_begun(1));
    const Lease first = *work.grant_indirect(k_a, 0, 1, k_a_second);
    CHECK(work.has_begun(1));
    const auto unneeded = work.cancel(1, 0);
    REQUIRE(unneeded.size() == 1);
    CHECK(unneeded.front().id == first.id);
    CHECK(work.cancel(1, 0).empty());
    CHECK(answer(work, first, 1).verdict == Verdict::duplicate);
    const Lease second = *work.grant_indirect(k_a, 0, 1, k_a_second);
    CHECK(second.first == 8);
    work.begin_epoch(Epoch{2}, 1);
    CHECK(answer(work, second, 1).verdict == Verdict::stale_epoch);
    const auto finished = work.take_finished();
    REQUIRE(finished.size() == 2);
    for (const RoundOutcome& outcome : finished) CHECK_FALSE(outcome.result.has_value());
    CHECK(work.rounds_committed() == 0);
    CHECK(bool(work.check_invariants()));
}

TEST_CASE("rounds are as long as a server's speed makes them, and whole where servers filter") {
    RelayWork work;
    work.set_servers({{k_a, 0}});
    work.begin(lease_of(1, 0, 4), 0);
    const Lease lease = *work.grant_indirect(k_a, 0, 1, k_a_second);
    // 32 samples in 40 ms: 800 per second, 5 samples of 8 pixels in 50 ms.
    CHECK(answer(work, lease, k_second_ns / 2, 40 * k_millisecond_ns).verdict == Verdict::accepted);
    work.begin(lease_of(2, 0, 20), 0);
    CHECK(work.grant_indirect(k_a, 0, 1, k_a_second)->count == 5);
    CHECK(work.leases_for(8) == 2);
    CHECK(work.leases_for(9) == 3);
    (void)work.cancel_all(0);
    RoundJob filtered = lease_of(3, 0, 20);
    filtered.settings.filter = FilterPlace::server;
    work.begin(filtered, 0);
    CHECK(work.grant_indirect(k_a, 0, 1, k_a_second)->count == 20);
}

TEST_CASE("a server that boasts about its time is believed as far as the clock bears it out") {
    RelayWork work;
    work.set_servers({{k_a, 0}});
    work.begin(lease_of(1, 0, 1), 0);
    const Lease lease = *work.grant_indirect(k_a, 0, 1, k_a_second);
    CHECK(answer(work, lease, k_second_ns, std::numeric_limits<TimeNs>::max()).verdict == Verdict::accepted);
    CHECK(work.take_finished().front().duration == k_second_ns);
}

/// Everything at once, by chance: grants, results, losses, copies and leases that are taken back, of a few seeds.
TEST_CASE("whatever happens, a lease that is answered has each of its samples once") {
    for (std::uint32_t seed = 1; seed <= 200; ++seed) {
        CAPTURE(seed);
        HashRng rng(seed);
        RelayWork work;
        work.set_servers({{k_a, 0}, {k_b, 0}});
        std::vector<Lease> granted;
        std::map<std::uint64_t, Round> asked;
        std::size_t answered = 0, taken_back = 0;
        TimeNs now = 0;
        for (int step = 0; step < 400; ++step) {
            now += 1 + rng.next_u32() % k_millisecond_ns;
            const ServerId server = rng.next_u32() % 2 ? k_a : k_b;
            switch (rng.next_u32() % 8) {
                case 0: {
                    const std::uint64_t ticket = asked.size() + 1;
                    const RoundJob job = lease_of(ticket, rng.next_u32() % 100, 1 + rng.next_u32() % 30);
                    asked[ticket] = job.round;
                    work.begin(job, now);
                    break;
                }
                case 1:
                    if (rng.next_u32() % 8 == 0) work.revoke(server, now);
                    break;
                case 2:
                    if (rng.next_u32() % 8 == 0 && !asked.empty())
                        (void)work.cancel(1 + rng.next_u32() % asked.size(), now);
                    break;
                case 3:
                    work.expire(now);
                    if (const auto copy = work.copy_straggler(server, now, takes(1), k_a_second))
                        granted.push_back(*copy);
                    break;
                case 4:
                    if (!granted.empty()) {
                        const Lease& lease = granted[rng.next_u32() % granted.size()];
                        work.release(lease.id, lease.server, now);
                    }
                    break;
                case 5:
                    if (const auto lease = work.grant_indirect(
                            server, now, 1 + rng.next_u32() % 4,
                            [](const Round&, std::uint32_t) { return 5 * k_millisecond_ns; }))
                        granted.push_back(*lease);
                    break;
                default:
                    if (!granted.empty()) (void)answer(work, granted[rng.next_u32() % granted.size()], now);
            }
            if (const auto sound = work.check_invariants(); !sound) FAIL(sound.error().message);
            for (const RoundOutcome& outcome : work.take_finished()) {
                const Round& round = asked.at(outcome.ticket);
                (outcome.result ? answered : taken_back) += 1;
                if (outcome.result)
                    CHECK(outcome.result->sums == flat_sums(round.rect, round.first, round.count));
            }
        }
        CHECK(answered + taken_back + work.leases() == asked.size());
        CHECK(answered > 0);
    }
}
