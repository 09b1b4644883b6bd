#include "pathscope/cluster/audit.hpp"

#include <cmath>

#include "pathscope/cluster/contributions.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

constexpr ServerId k_a{1}, k_b{2}, k_c{3};
constexpr Digest k_honest{1}, k_false{2}, k_also_false{3};
constexpr TimeNs k_second_later = k_second_ns;

AuditedRound merged(std::uint32_t unit, ServerId author, const Digest& result) {
    return {{unit, 0}, {0, 4}, author, result};
}

/// The next item of this server, granted to it as lease `number`.
ResultClaim grant(Audit& audit, ServerId server, std::uint64_t number) {
    const auto item = audit.next_for(server);
    REQUIRE(item);
    const Lease lease{
        LeaseId{number}, Epoch{1}, item->round.unit, item->samples.first, item->samples.count, server, 0,
        k_second_later,  true};
    audit.grant(*item, lease);
    return {lease.id, lease.epoch, lease.unit, lease.first, lease.count, server};
}

const auto k_nobody = [](ServerId) { return true; };
const auto k_somebody = [](ServerId) { return false; };

}  // namespace

TEST_CASE("the share of rounds that is chosen is the one asked for, and its choice is the client's secret") {
    constexpr int k_rounds = 40'000;
    for (const double share : {0.0, 0.02, 0.5, 1.0}) {
        const Audit audit({share, 7}), other({share, 8});
        int chosen = 0, both = 0;
        for (std::uint32_t i = 0; i < k_rounds; ++i) {
            const RoundKey round{i / 16, i % 16};
            chosen += audit.chosen(round);
            both += audit.chosen(round) && other.chosen(round);
        }
        // Binomial: five standard deviations, that is once in 1.7 million seeds.
        const auto is_binomial = [&](int count, double p) {
            return std::abs(count - k_rounds * p) <= 5 * std::sqrt(k_rounds * p * (1 - p)) + 1e-9;
        };
        CHECK(is_binomial(chosen, share));
        CHECK(is_binomial(both, share * share));
    }
}

TEST_CASE("a second opinion comes from another server, and if it agrees that is all") {
    Audit audit({1, 0});
    CHECK_FALSE(audit.on_merged(merged(5, k_local_server, k_honest)));
    CHECK(audit.settled());
    CHECK(audit.on_merged(merged(5, k_a, k_honest)));
    CHECK_FALSE(audit.settled());
    CHECK_FALSE(audit.next_for(k_a));
    const ResultClaim claim = grant(audit, k_b, 9);
    CHECK_FALSE(audit.next_for(k_c));  // One is enough.
    CHECK(audit.holds(claim));
    ResultClaim of_another = claim;
    of_another.server = k_c;
    CHECK_FALSE(audit.holds(of_another));
    CHECK(audit.on_opinion(claim, k_honest));
    CHECK(audit.settled());
    CHECK_FALSE(audit.holds(claim));
}

TEST_CASE("where opinions differ the client judges: one of them lied, or both") {
    struct Case {
        Digest first, second;
        std::vector<ServerId> liars;
    };
    for (const Case& c : {Case{k_false, k_honest, {k_a}}, Case{k_honest, k_false, {k_b}},
                          Case{k_false, k_also_false, {k_a, k_b}}}) {
        Audit audit({1, 0});
        audit.on_merged(merged(5, k_a, c.first));
        CHECK_FALSE(audit.on_opinion(grant(audit, k_b, 9), c.second));
        CHECK_FALSE(audit.next_for(k_c));
        const auto item = audit.next_for_client(k_somebody);
        REQUIRE(item);
        audit.grant_to_client(item->round);
        CHECK_FALSE(audit.next_for_client(k_somebody));
        CHECK_FALSE(audit.settled());
        CHECK(audit.on_truth(item->round, k_honest) == c.liars);
        CHECK(audit.settled());
        CHECK(audit.on_truth(item->round, k_false).empty());  // It is over.
    }
}

TEST_CASE("where there is no other server, the client's opinion is the second one") {
    Audit audit({1, 0});
    audit.on_merged(merged(5, k_a, k_false));
    CHECK_FALSE(audit.next_for_client(k_somebody));
    audit.grant_to_client(audit.next_for_client(k_nobody)->round);
    CHECK_FALSE(audit.next_for(k_b));
    audit.release_client({5, 0});  // It was cancelled.
    CHECK(audit.next_for(k_b));
    audit.grant_to_client(audit.next_for_client(k_nobody)->round);
    CHECK(audit.on_truth({5, 0}, k_honest) == std::vector{k_a});
}

TEST_CASE("an opinion that does not come is asked for elsewhere, at last of the client") {
    Audit audit({1, 0});
    audit.on_merged(merged(5, k_a, k_honest));
    grant(audit, k_b, 9);
    CHECK(audit.next_deadline() == k_second_later);
    audit.expire(k_second_later - 1);
    CHECK_FALSE(audit.next_for(k_c));
    audit.expire(k_second_later);
    CHECK_FALSE(audit.next_deadline());
    CHECK(audit.next_for(k_c)->attempts == 1);
    grant(audit, k_c, 10);
    CHECK_FALSE(audit.release(LeaseId{10}, k_b));
    CHECK(audit.release(LeaseId{10}, k_c));
    const ResultClaim claim = grant(audit, k_b, 11);
    audit.revoke(k_b);
    CHECK_FALSE(audit.holds(claim));
    CHECK_FALSE(audit.next_for(k_c));  // Three did not get it done.
    CHECK(audit.next_for_client(k_somebody));
}

TEST_CASE("what is rendered again is audited again, and what is stopped is not") {
    Audit audit({1, 0});
    for (const std::uint32_t unit : {4, 5, 6}) audit.on_merged(merged(unit, k_a, k_honest));
    const ResultClaim held = grant(audit, k_b, 9);
    CHECK(held.unit == 4);
    const auto cancelled = audit.forget(4);
    REQUIRE(cancelled.size() == 1);
    CHECK(cancelled[0].id == LeaseId{9});
    CHECK_FALSE(audit.holds(held));
    CHECK(audit.on_merged(merged(4, k_c, k_honest)));
    CHECK(audit.unsettled() == 3);

    const ResultClaim last = grant(audit, k_b, 10);
    audit.stop();
    CHECK(audit.unsettled() == 1);
    CHECK_FALSE(audit.on_merged(merged(7, k_a, k_honest)));
    CHECK(audit.on_opinion(last, k_honest));
    CHECK(audit.settled());
    audit.begin();
    CHECK(audit.on_merged(merged(7, k_a, k_honest)));
}

TEST_CASE("contributions tell which units hold something of a server, and how much there is to take back") {
    Contributions gave;
    gave.add(2, {k_a, 1, 3, 16, 48, 0, 0});
    gave.add(2, {k_b, 1, 1, 16, 50, 1, 0});
    gave.add(2, {k_a, 1, 2, 8, 20, 0, 2});
    gave.add(7, {k_b, 1, 1, 16, 40, 0, 0});
    const std::array<ServerId, 1> only_a{k_a};
    const std::array<ServerId, 2> both{k_a, k_b};
    CHECK(gave.units_of(only_a) == std::vector<std::uint32_t>{2});
    CHECK(gave.units_of(both) == std::vector<std::uint32_t>{2, 7});
    const auto taken = gave.take(2);
    REQUIRE(taken.size() == 2);
    CHECK(taken[0].tiles == 2);
    CHECK(taken[0].rounds == 5);
    CHECK(taken[0].samples == 24);
    CHECK(taken[0].rays == 68);
    CHECK(taken[0].saturated == 2);
    CHECK(taken[1].nonfinite == 1);
    CHECK(gave.take(2).empty());
    CHECK(gave.units_of(only_a).empty());
}
