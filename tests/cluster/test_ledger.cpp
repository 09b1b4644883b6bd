#include "pathscope/cluster/ledger.hpp"

#include <algorithm>
#include <set>
#include <vector>

#include "testing.hpp"

using namespace pathscope;

namespace {

constexpr ServerId k_a{1}, k_b{2}, k_c{3};
constexpr TimeNs k_lease = k_second_ns;

LedgerPlan plan_of(std::uint32_t units, std::uint32_t samples, std::uint32_t round_samples,
                   std::uint32_t epoch = 1) {
    return {Epoch{epoch}, units, samples, round_samples};
}

Ledger ledger_of(const LedgerPlan& plan, EventStore* store = nullptr) {
    Ledger ledger(store);
    ledger.new_epoch(plan, 0);
    return ledger;
}

ResultClaim claim_of(const Lease& lease) {
    return {lease.id, lease.epoch, lease.unit, lease.first, lease.count, lease.server};
}

Verdict verdict_of(Ledger& ledger, const ResultClaim& claim) {
    const Verdict judged = ledger.judge(claim);
    const Verdict committed = ledger.commit(claim, 0).verdict;
    CHECK(judged == committed);
    return committed;
}

void check_sound(const Ledger& ledger) {
    const Result<void> sound = ledger.check_invariants();
    CHECK_MESSAGE(bool(sound), (sound ? "" : sound.error().message));
}

std::vector<UnitReason> reasons_in(const EventStore& store) {
    std::vector<UnitReason> reasons;
    store.visit_since(0,
                      [&](const Event& event) { reasons.push_back(std::get<UnitEvent>(event.body).reason); });
    return reasons;
}

}  // namespace

TEST_CASE("a staged plan grants what is open, group by group with samples of its own") {
    LedgerPlan plan = plan_of(4, 6, 4);  // Two blocks, each a unit of two groups.
    plan.staged = true;
    plan.group_units = 2;
    plan.group_samples = 100;
    EventStore store;
    Ledger ledger = ledger_of(plan, &store);
    CHECK(ledger.complete());
    CHECK(!ledger.grant(k_a, {0, 0}, 0, k_lease));
    CHECK(!ledger.next_fresh(0));

    ledger.open(1, 2);
    ledger.open(3, 3);
    CHECK(ledger.rounds() == 5);
    CHECK(store.total(Counter::rounds) == 5);
    CHECK(!ledger.complete());
    CHECK(!ledger.grant(k_a, {0, 0}, 0, k_lease));
    std::vector<Lease> leases;
    for (const std::uint32_t unit : {1u, 3u})
        while (const auto next = ledger.next_fresh(unit))
            leases.push_back(ledger.grant(k_a, *next, 0, k_lease).value());
    REQUIRE(leases.size() == 5);
    const SampleRange expected[] = {{0, 4}, {4, 2}, {100, 1}, {101, 1}, {102, 1}};
    for (std::size_t i = 0; i < leases.size(); ++i) {
        CHECK(SampleRange{leases[i].first, leases[i].count} == expected[i]);
        CHECK(ledger.rounds_of(leases[i]).first ==
              RoundKey{i < 2 ? 1u : 3u, std::uint32_t(i < 2 ? i : i - 2)});
        CHECK(verdict_of(ledger, claim_of(leases[i])) == Verdict::accepted);
        CHECK(verdict_of(ledger, claim_of(leases[i])) == Verdict::duplicate);
        check_sound(ledger);
    }
    CHECK(ledger.complete());
    CHECK(ledger.samples_committed(1) == 6);
    CHECK(ledger.samples_committed(3) == 3);

    // A round that is not open, one of the other group's numbers, and one before a group's first.
    ResultClaim claim = claim_of(leases[4]);
    claim.first = 103;
    CHECK(verdict_of(ledger, claim) == Verdict::mismatched);
    claim.first = 0;
    CHECK(verdict_of(ledger, claim) == Verdict::mismatched);
    ledger.open(3, 4);
    CHECK(!ledger.complete());
    CHECK(ledger.next_fresh(3) == RoundKey{3, 3});
    CHECK(!ledger.next_fresh(1));
    check_sound(ledger);
}

TEST_CASE("rounds cut a unit's samples without gap or overlap") {
    for (const std::uint32_t samples : {0u, 1u, 3u, 4u, 5u, 64u, 65u})
        for (const std::uint32_t round_samples : {1u, 3u, 4u, 100u}) {
            const LedgerPlan plan = plan_of(1, samples, round_samples);
            std::uint32_t next = 0;
            for (std::uint32_t i = 0; i < plan.rounds_per_unit(); ++i) {
                const SampleRange range = samples_of_round(plan, {0, i});
                CHECK(range.first == next);
                CHECK(range.count > 0);
                CHECK(range.count <= round_samples);
                next += range.count;
            }
            CHECK(next == samples);
        }
}

TEST_CASE("each round is granted and committed once, then the account is complete") {
    Ledger ledger = ledger_of(plan_of(3, 10, 4));  // rounds of 4, 4 and 2 samples
    CHECK(ledger.rounds() == 9);
    std::set<std::pair<std::uint32_t, std::uint32_t>> granted;
    for (std::uint32_t unit = 0; unit < 3; ++unit)
        while (const auto round = ledger.next_fresh(unit)) {
            CHECK_FALSE(ledger.complete());
            const Lease lease = *ledger.grant(k_a, *round, 0, k_lease);
            CHECK(granted.emplace(lease.unit, lease.first).second);
            CHECK(verdict_of(ledger, claim_of(lease)) == Verdict::accepted);
            check_sound(ledger);
        }
    CHECK(granted.size() == 9);
    CHECK(ledger.complete());
    for (std::uint32_t unit = 0; unit < 3; ++unit) CHECK(ledger.samples_committed(unit) == 10);
}

TEST_CASE("an empty plan is complete at once") {
    CHECK(ledger_of(plan_of(0, 10, 4)).complete());
    CHECK(ledger_of(plan_of(5, 0, 4)).complete());
}

TEST_CASE("only open rounds are granted: not held ones, not committed ones, not out of turn") {
    Ledger ledger = ledger_of(plan_of(2, 3, 1));
    CHECK_FALSE(ledger.grant(k_a, {0, 1}, 0, k_lease).has_value());
    CHECK_FALSE(ledger.grant(k_a, {2, 0}, 0, k_lease).has_value());
    const Lease lease = *ledger.grant(k_a, {0, 0}, 0, k_lease);
    CHECK_FALSE(ledger.grant(k_b, {0, 0}, 0, k_lease).has_value());
    ledger.commit(claim_of(lease), 0);
    CHECK_FALSE(ledger.grant(k_b, {0, 0}, 0, k_lease).has_value());
    CHECK(ledger.counts().granted == 1);
    check_sound(ledger);
}

TEST_CASE("a repeated result is a duplicate, though the lease's record is gone") {
    Ledger ledger = ledger_of(plan_of(1, 2, 1));
    const Lease lease = *ledger.grant(k_a, {0, 0}, 0, k_lease);
    CHECK(verdict_of(ledger, claim_of(lease)) == Verdict::accepted);
    CHECK(verdict_of(ledger, claim_of(lease)) == Verdict::duplicate);
    CHECK(verdict_of(ledger, claim_of(lease)) == Verdict::duplicate);
    CHECK(ledger.samples_committed(0) == 1);
    CHECK(ledger.counts().duplicates == 2);
    check_sound(ledger);
}

TEST_CASE("a result that is not what its lease says is refused, and the lease stays") {
    Ledger ledger = ledger_of(plan_of(4, 8, 4));
    const Lease lease = *ledger.grant(k_a, {1, 0}, 0, k_lease);
    const ResultClaim good = claim_of(lease);
    const auto altered = [&](auto alter) {
        ResultClaim claim = good;
        alter(claim);
        return claim;
    };
    CHECK(verdict_of(ledger, altered([](ResultClaim& c) { c.server = k_b; })) == Verdict::mismatched);
    CHECK(verdict_of(ledger, altered([](ResultClaim& c) { c.unit = 2; })) == Verdict::mismatched);
    CHECK(verdict_of(ledger, altered([](ResultClaim& c) { c.first = 4; })) == Verdict::mismatched);
    CHECK(verdict_of(ledger, altered([](ResultClaim& c) { c.count = 3; })) == Verdict::mismatched);
    CHECK(verdict_of(ledger, altered([](ResultClaim& c) { c.lease.value = 0; })) == Verdict::unknown);
    CHECK(verdict_of(ledger, altered([](ResultClaim& c) { c.lease.value = 99; })) == Verdict::unknown);
    CHECK(verdict_of(ledger, altered([](ResultClaim& c) { c.epoch.value = 2; })) == Verdict::unknown);
    CHECK(verdict_of(ledger, altered([](ResultClaim& c) { c.epoch.value = 0; })) == Verdict::stale_epoch);
    check_sound(ledger);
    CHECK(ledger.outstanding() == 1);
    CHECK(verdict_of(ledger, good) == Verdict::accepted);

    // Without the record, the range must still be one of the plan's, and committed to be a duplicate.
    CHECK(verdict_of(ledger, altered([](ResultClaim& c) { c.first = 4; })) == Verdict::forgotten);
    CHECK(verdict_of(ledger, altered([](ResultClaim& c) { c.first = 2; })) == Verdict::mismatched);
    CHECK(verdict_of(ledger, altered([](ResultClaim& c) { c.unit = 4; })) == Verdict::mismatched);
    CHECK(verdict_of(ledger, altered([](ResultClaim& c) { c.first = ~0u, c.count = ~0u; })) ==
          Verdict::mismatched);
    check_sound(ledger);
}

TEST_CASE("an expired lease reopens its round; its late result is welcome if it is the first") {
    Ledger ledger = ledger_of(plan_of(2, 1, 1));
    const Lease slow = *ledger.grant(k_a, {0, 0}, 0, k_lease);
    CHECK(*ledger.next_deadline() == k_lease);
    CHECK(ledger.expire(k_lease - 1).empty());
    CHECK(ledger.expire(k_lease).size() == 1);
    CHECK(ledger.reopened().size() == 1);
    CHECK_FALSE(ledger.next_deadline().has_value());

    SUBCASE("nobody was given the round meanwhile") {
        const Commit commit = ledger.commit(claim_of(slow), 2 * k_lease);
        CHECK(commit.verdict == Verdict::accepted);
        CHECK(commit.late);
        CHECK(commit.since_grant == 2 * k_lease);
        CHECK(ledger.reopened().empty());
        CHECK_FALSE(ledger.grant(k_b, {0, 0}, 0, k_lease).has_value());
    }
    SUBCASE("another holds it: the late result is first, the other is told to stop, and is a duplicate") {
        const Lease second = *ledger.grant(k_b, {0, 0}, k_lease, k_lease);
        const Commit commit = ledger.commit(claim_of(slow), 2 * k_lease - 1);
        CHECK(commit.verdict == Verdict::accepted);
        REQUIRE(commit.superseded.size() == 1);
        CHECK(commit.superseded[0].id == second.id);
        CHECK(ledger.outstanding() == 0);
        CHECK(verdict_of(ledger, claim_of(second)) == Verdict::duplicate);
    }
    SUBCASE("another was quicker: the late result is a duplicate") {
        const Lease second = *ledger.grant(k_b, {0, 0}, k_lease, k_lease);
        CHECK(verdict_of(ledger, claim_of(second)) == Verdict::accepted);
        CHECK(verdict_of(ledger, claim_of(slow)) == Verdict::duplicate);
    }
    CHECK(ledger.samples_committed(0) == 1);
    CHECK(ledger.counts().expired == 1);
    check_sound(ledger);
}

TEST_CASE("a dead server's rounds reopen before fresh ones, in the order of granting, and count when moved") {
    EventStore store(ProbeLevel::full);
    Ledger ledger = ledger_of(plan_of(4, 1, 1), &store);
    for (std::uint32_t unit = 0; unit < 3; ++unit) ledger.grant(unit == 1 ? k_b : k_a, {unit, 0}, 0, k_lease);
    CHECK(ledger.outstanding(k_a) == 2);
    CHECK(ledger.revoke(k_a, 1).size() == 2);
    CHECK(ledger.revoke(k_a, 1).empty());
    CHECK(ledger.outstanding(k_a) == 0);
    CHECK(ledger.outstanding(k_b) == 1);
    CHECK(ledger.reopened() == std::deque<RoundKey>{{0, 0}, {2, 0}});

    ledger.grant(k_b, {0, 0}, 2, k_lease);
    ledger.grant(k_a, {2, 0}, 2, k_lease);
    CHECK(ledger.counts().reallocated == 1);  // the second went back to the server that had it
    CHECK(ledger.attempts({0, 0}) == 2);
    CHECK(ledger.last_owner(0) == k_b);
    CHECK(reasons_in(store) == std::vector<UnitReason>{UnitReason::fresh, UnitReason::fresh,
                                                       UnitReason::fresh, UnitReason::server_lost,
                                                       UnitReason::server_lost, UnitReason::reallocated,
                                                       UnitReason::retried});
    check_sound(ledger);
}

TEST_CASE("a lease given back reopens its round; only its holder can give it back") {
    Ledger ledger = ledger_of(plan_of(1, 1, 1));
    const Lease lease = *ledger.grant(k_a, {0, 0}, 0, k_lease);
    CHECK_FALSE(ledger.release(lease.id, k_b, 0).has_value());
    CHECK_FALSE(ledger.release(LeaseId{9}, k_a, 0).has_value());
    CHECK(ledger.release(lease.id, k_a, 0)->id == lease.id);
    CHECK_FALSE(ledger.release(lease.id, k_a, 0).has_value());
    CHECK(ledger.reopened().size() == 1);
    // It said that no result would come; one that comes all the same is not believed.
    CHECK(verdict_of(ledger, claim_of(lease)) == Verdict::forgotten);
    check_sound(ledger);
}

TEST_CASE("a straggler's round goes to one more server, and the first result counts") {
    Ledger ledger = ledger_of(plan_of(1, 1, 1));
    CHECK_FALSE(ledger.grant_copy(k_b, {0, 0}, 0, k_lease).has_value());  // nobody holds it
    const Lease slow = *ledger.grant(k_a, {0, 0}, 0, k_lease);
    CHECK_FALSE(ledger.grant_copy(k_a, {0, 0}, 0, k_lease).has_value());  // not to the same server
    CHECK(ledger.oldest_uncopied(k_b)->id == slow.id);
    CHECK_FALSE(ledger.oldest_uncopied(k_a).has_value());
    const Lease copy = *ledger.grant_copy(k_b, {0, 0}, 0, 2 * k_lease);
    CHECK(copy.copy);
    CHECK_FALSE(ledger.grant_copy(k_c, {0, 0}, 0, k_lease).has_value());  // two are enough
    CHECK_FALSE(ledger.oldest_uncopied(k_c).has_value());

    SUBCASE("the copy is first") {
        const Commit commit = ledger.commit(claim_of(copy), 1);
        CHECK(commit.superseded.size() == 1);
        CHECK(verdict_of(ledger, claim_of(slow)) == Verdict::duplicate);
    }
    SUBCASE("the slow one expires: the round is not reopened while the copy is out") {
        CHECK(ledger.expire(k_lease).size() == 1);
        CHECK(ledger.reopened().empty());
        CHECK(ledger.commit(claim_of(slow), 1).late);
    }
    SUBCASE("both end: it is reopened once") {
        ledger.revoke(k_b, 1);
        CHECK(ledger.reopened().empty());
        ledger.revoke(k_a, 1);
        CHECK(ledger.reopened().size() == 1);
    }
    check_sound(ledger);
}

TEST_CASE("a new epoch drops everything of the old one") {
    Ledger ledger = ledger_of(plan_of(2, 2, 1));
    const Lease committed = *ledger.grant(k_a, {0, 0}, 0, k_lease);
    ledger.commit(claim_of(committed), 0);
    const Lease old = *ledger.grant(k_a, {1, 0}, 0, k_lease);
    const std::vector<Lease> dropped = ledger.new_epoch(plan_of(3, 2, 2, 2), 1);
    REQUIRE(dropped.size() == 1);
    CHECK(dropped[0].id == old.id);
    CHECK(ledger.rounds_committed() == 0);
    CHECK(ledger.outstanding(k_a) == 0);
    CHECK(ledger.expire(100 * k_lease).empty());

    const Lease fresh = *ledger.grant(k_a, {1, 0}, 1, k_lease);
    CHECK(verdict_of(ledger, claim_of(old)) == Verdict::stale_epoch);
    ResultClaim disguised = claim_of(old);
    disguised.epoch = Epoch{2};
    CHECK(verdict_of(ledger, disguised) == Verdict::mismatched);
    disguised.count = 2;  // even with the new epoch's range
    CHECK(verdict_of(ledger, disguised) == Verdict::mismatched);
    CHECK(ledger.samples_committed(1) == 0);
    CHECK(verdict_of(ledger, claim_of(fresh)) == Verdict::accepted);
    CHECK(ledger.counts().dropped == 1);
    CHECK(ledger.counts().stale == 1);
    check_sound(ledger);
}

TEST_CASE("open-ended work goes on until stop, then waits for what is out") {
    Ledger ledger = ledger_of(plan_of(2, k_open_ended, 8));
    std::vector<Lease> out;
    for (int i = 0; i < 100; ++i) out.push_back(*ledger.grant(k_a, *ledger.next_fresh(0), 0, k_lease));
    out.push_back(*ledger.grant(k_a, *ledger.next_fresh(1), 0, k_lease));
    CHECK(ledger.rounds() == 101);
    ledger.release(out[0].id, k_a, 0);
    ledger.stop();
    CHECK_FALSE(ledger.next_fresh(0).has_value());
    CHECK_FALSE(ledger.grant(k_a, {0, 0}, 0, k_lease).has_value());
    CHECK_FALSE(ledger.grant_copy(k_b, {0, 1}, 0, k_lease).has_value());
    for (std::size_t i = 1; i < out.size(); ++i) {
        CHECK_FALSE(ledger.complete());
        CHECK(verdict_of(ledger, claim_of(out[i])) == Verdict::accepted);
    }
    CHECK(ledger.complete());
    CHECK(ledger.samples_committed(0) == 99 * 8);
    CHECK(ledger.samples_committed(1) == 8);
    check_sound(ledger);
}

TEST_CASE("a round that nobody finishes does not fill the memory, and its oldest holder is still welcome") {
    Ledger ledger = ledger_of(plan_of(1, 1, 1));
    std::vector<Lease> leases;
    for (std::uint32_t i = 0; i < 100; ++i) {
        leases.push_back(*ledger.grant(ServerId{1 + i}, {0, 0}, TimeNs(i), 1));
        CHECK(ledger.expire(TimeNs(i) + 1).size() == 1);
        check_sound(ledger);  // bounds the records of a round
    }
    CHECK(ledger.attempts({0, 0}) == 100);
    CHECK(verdict_of(ledger, claim_of(leases[50])) == Verdict::forgotten);
    CHECK(verdict_of(ledger, claim_of(leases[0])) == Verdict::accepted);
    CHECK(verdict_of(ledger, claim_of(leases[50])) == Verdict::duplicate);
}

TEST_CASE("a checkpoint restores what was committed, and nothing else") {
    const LedgerPlan plan = plan_of(3, 20, 4);
    Ledger before = ledger_of(plan);
    // Unit 0: rounds 0 and 2 committed, 1 and 3 out. Unit 1: all. Unit 2: nothing.
    std::vector<Lease> out;
    for (int i = 0; i < 4; ++i) out.push_back(*before.grant(k_a, *before.next_fresh(0), 0, k_lease));
    before.commit(claim_of(out[0]), 0);
    before.commit(claim_of(out[2]), 0);
    while (const auto round = before.next_fresh(1))
        before.commit(claim_of(*before.grant(k_b, *round, 0, k_lease)), 0);

    EventStore store;
    Ledger after = ledger_of(plan, &store);
    for (std::uint32_t unit = 0; unit < 3; ++unit) REQUIRE(bool(after.restore(unit, before.snapshot(unit))));
    check_sound(after);
    CHECK(after.rounds_committed() == 7);
    CHECK(store.total(Counter::rounds_committed) == 7);
    CHECK(after.reopened() == std::deque<RoundKey>{{0, 1}, {0, 3}});
    for (std::uint32_t unit = 0; unit < 3; ++unit)
        CHECK(after.samples_committed(unit) == before.samples_committed(unit));
    CHECK(verdict_of(after, claim_of(out[1])) == Verdict::unknown);  // a lease of the client that died

    while (!after.reopened().empty())
        after.commit(claim_of(*after.grant(k_c, after.reopened().front(), 0, k_lease)), 0);
    for (const std::uint32_t unit : {0u, 2u})
        while (const auto round = after.next_fresh(unit))
            after.commit(claim_of(*after.grant(k_c, *round, 0, k_lease)), 0);
    CHECK(after.complete());
    CHECK(after.counts().accepted == 8);
    check_sound(after);
}

TEST_CASE("a checkpoint that does not fit the plan is refused") {
    Ledger ledger = ledger_of(plan_of(2, 4, 1));
    CHECK_FALSE(bool(ledger.restore(2, {1, {}})));
    CHECK_FALSE(bool(ledger.restore(0, {5, {}})));
    CHECK_FALSE(bool(ledger.restore(0, {3, {3}})));
    CHECK_FALSE(bool(ledger.restore(0, {3, {1, 1}})));
    CHECK_FALSE(bool(ledger.restore(0, {3, {2, 1}})));
    CHECK(bool(ledger.restore(0, {3, {1, 2}})));
    CHECK_FALSE(bool(ledger.restore(0, {3, {}})));
    check_sound(ledger);
}

TEST_CASE("the store's counters are the ledger's") {
    EventStore store;
    Ledger ledger = ledger_of(plan_of(4, 8, 2), &store);
    const Lease a = *ledger.grant(k_a, {0, 0}, 0, k_lease);
    const Lease b = *ledger.grant(k_b, {1, 0}, 0, k_lease);
    ledger.grant_copy(k_b, {0, 0}, 0, 3 * k_lease);
    ledger.commit(claim_of(b), 5);
    ledger.commit(claim_of(b), 6);
    ledger.expire(k_lease);
    ledger.revoke(k_b, k_lease);
    ledger.grant(k_c, {0, 0}, k_lease, k_lease);
    ledger.commit(claim_of(a), k_lease);
    ledger.commit({LeaseId{77}, Epoch{1}, 0, 0, 2, k_a}, k_lease);
    ledger.commit({LeaseId{1}, Epoch{0}, 0, 0, 2, k_a}, k_lease);

    CHECK(store.total(Counter::rounds) == 16);
    CHECK(store.total(Counter::rounds_committed) == ledger.rounds_committed());
    CHECK(store.total(Counter::leases_granted) == ledger.counts().granted);
    CHECK(store.total(Counter::leases_expired) == ledger.counts().expired);
    CHECK(store.total(Counter::reallocated) == ledger.counts().reallocated);
    CHECK(store.total(Counter::speculated) == ledger.counts().copied);
    CHECK(store.total(Counter::duplicates_dropped) == 1);
    CHECK(store.total(Counter::stale_dropped) == 1);
    CHECK(store.total(Counter::refused_results) == 1);
    for (const ServerId server : {k_a, k_b})
        CHECK(store.server(server)->total(Counter::rounds_committed) == 1);
    CHECK(store.server(k_c)->total(Counter::reallocated) == 1);
    check_sound(ledger);
}

// ---- Leases of several rounds.

TEST_CASE("one lease holds rounds that follow each other, and brings them together") {
    EventStore store;
    Ledger ledger = ledger_of(plan_of(2, 10, 4), &store);  // Rounds of 4, 4 and 2 samples.
    CHECK(ledger.rounds_waiting() == 6);
    CHECK(ledger.grantable({0, 0}, 2).rounds == 2);
    CHECK(ledger.grantable({0, 0}, 9).rounds == 3);
    CHECK(ledger.grantable({0, 1}, 1).rounds == 0);  // Out of turn.
    CHECK(ledger.grantable({2, 0}, 1).rounds == 0);
    CHECK_FALSE(ledger.grant(k_a, RoundRun({0, 0}, 4), 0, k_lease).has_value());
    CHECK_FALSE(ledger.grant(k_a, RoundRun({0, 0}, 0), 0, k_lease).has_value());

    const Lease one = *ledger.grant(k_a, {0, 0}, 0, k_lease);
    const Lease two = *ledger.grant(k_b, ledger.grantable({0, 1}, 9), 0, k_lease);
    CHECK(SampleRange{two.first, two.count} == SampleRange{4, 6});
    CHECK(ledger.rounds_of(two).rounds == 2);
    CHECK(ledger.rounds_waiting() == 3);
    CHECK(ledger.outstanding() == 2);
    check_sound(ledger);

    for (auto [first, count] :
         {SampleRange{4, 4}, SampleRange{8, 2}, SampleRange{4, 5}, SampleRange{0, 10}}) {
        ResultClaim part = claim_of(two);  // Taken whole or not at all.
        part.first = first;
        part.count = count;
        CHECK(verdict_of(ledger, part) == Verdict::mismatched);
    }
    const Commit commit = ledger.commit(claim_of(two), 5);
    CHECK(commit.verdict == Verdict::accepted);
    CHECK(commit.rounds == 2);
    CHECK(ledger.rounds_committed() == 2);
    CHECK(store.total(Counter::rounds_committed) == 2);
    CHECK(ledger.samples_committed(0) == 6);
    CHECK(verdict_of(ledger, claim_of(two)) == Verdict::duplicate);
    CHECK(ledger.snapshot(0).missing == std::vector<std::uint32_t>{0});
    check_sound(ledger);
    CHECK(verdict_of(ledger, claim_of(one)) == Verdict::accepted);
    CHECK(ledger.samples_committed(0) == 10);
    check_sound(ledger);
}

TEST_CASE("the rounds of a lease that ends are open again, and go on together or apart") {
    Ledger ledger = ledger_of(plan_of(1, 6, 1));
    const Lease three = *ledger.grant(k_a, RoundRun({0, 0}, 3), 0, k_lease);
    const Lease rest = *ledger.grant(k_b, RoundRun({0, 3}, 3), 0, k_lease);
    CHECK(ledger.expire(k_lease).size() == 2);
    CHECK(ledger.reopened().size() == 6);
    check_sound(ledger);
    CHECK(ledger.grantable({0, 1}, 9).rounds == 2);  // Up to where another server held them.
    const Lease middle = *ledger.grant(k_c, RoundRun({0, 1}, 1), k_lease, k_lease);
    CHECK(ledger.counts().reallocated == 1);
    CHECK(ledger.grantable({0, 0}, 9).rounds == 1);
    CHECK_FALSE(ledger.grant(k_c, RoundRun({0, 0}, 2), k_lease, k_lease).has_value());
    CHECK(ledger.release(middle.id, k_c, k_lease)->id == middle.id);
    check_sound(ledger);

    // Late, but nobody was quicker.
    CHECK(verdict_of(ledger, claim_of(rest)) == Verdict::accepted);
    CHECK(verdict_of(ledger, claim_of(three)) == Verdict::accepted);
    CHECK(ledger.counts().late == 2);
    CHECK(ledger.complete());
    check_sound(ledger);
}

TEST_CASE("a late result of which a round is committed counts nothing, and the others are still to be done") {
    Ledger ledger = ledger_of(plan_of(1, 3, 1));
    const Lease all = *ledger.grant(k_a, RoundRun({0, 0}, 3), 0, k_lease);
    ledger.expire(k_lease);
    const Lease middle = *ledger.grant(k_b, {0, 1}, k_lease, k_lease);
    CHECK(verdict_of(ledger, claim_of(middle)) == Verdict::accepted);
    CHECK(verdict_of(ledger, claim_of(all)) == Verdict::duplicate);
    CHECK(ledger.samples_committed(0) == 1);
    CHECK(ledger.reopened().size() == 2);
    check_sound(ledger);
}

TEST_CASE("a late result supersedes whoever holds a round of it, and what they hold beyond is open again") {
    EventStore store;
    Ledger ledger = ledger_of(plan_of(1, 4, 1), &store);
    const Lease slow = *ledger.grant(k_a, RoundRun({0, 0}, 2), 0, k_lease);
    const Lease next = *ledger.grant(k_a, RoundRun({0, 2}, 2), 0, k_lease);
    ledger.expire(k_lease);
    const Lease other = *ledger.grant(k_b, ledger.grantable({0, 1}, 3), k_lease, k_lease);
    CHECK(other.count == 3);
    CHECK(ledger.reopened().size() == 1);
    const Commit commit = ledger.commit(claim_of(slow), k_lease);
    CHECK(commit.verdict == Verdict::accepted);
    CHECK(commit.late);
    REQUIRE(commit.superseded.size() == 1);
    CHECK(commit.superseded.front().id == other.id);
    CHECK(ledger.outstanding() == 0);
    CHECK(ledger.reopened().size() == 2);
    check_sound(ledger);
    CHECK(verdict_of(ledger, claim_of(other)) == Verdict::duplicate);
    CHECK(verdict_of(ledger, claim_of(next)) == Verdict::accepted);  // It is remembered still.
    CHECK(ledger.complete());
    check_sound(ledger);
}

TEST_CASE("a straggler's rounds are copied together") {
    Ledger ledger = ledger_of(plan_of(1, 3, 1));
    const Lease slow = *ledger.grant(k_a, RoundRun({0, 0}, 3), 0, k_lease);
    const Lease copy = *ledger.grant_copy(k_b, {0, 2}, 0, 2 * k_lease);
    CHECK(copy.first == slow.first);
    CHECK(copy.count == slow.count);
    CHECK(ledger.expire(k_lease).size() == 1);
    CHECK(ledger.reopened().empty());  // The copy holds them.
    check_sound(ledger);
    CHECK(verdict_of(ledger, claim_of(copy)) == Verdict::accepted);
    CHECK(verdict_of(ledger, claim_of(slow)) == Verdict::duplicate);
    CHECK(ledger.complete());
    check_sound(ledger);
}

TEST_CASE("no claim about rounds is too large to be judged") {
    Ledger ledger = ledger_of(plan_of(2, 7, 2));
    const Lease lease = *ledger.grant(k_a, {0, 0}, 0, k_lease);
    for (const std::uint32_t number : {0u, 1u, 3u, 6u, 7u, 8u, 1u << 20, 1u << 31, ~0u - 1, ~0u}) {
        ResultClaim claim = claim_of(lease);
        claim.lease.value = 1;  // Known, but of other work.
        claim.first = number;
        CHECK(verdict_of(ledger, claim) == (number == 0 ? Verdict::accepted : Verdict::mismatched));
        if (number == 0) continue;
        claim.first = 0;
        claim.count = number;
        CHECK(verdict_of(ledger, claim) ==
              (number == 6 || number == 7 ? Verdict::duplicate : Verdict::mismatched));
        claim.unit = number;
        claim.count = 2;
        CHECK(verdict_of(ledger, claim) == (number == 1 ? Verdict::forgotten : Verdict::mismatched));
    }
    check_sound(ledger);
}
