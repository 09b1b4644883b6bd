/// Audits on a stage: what a client believes, and what becomes of the light of those who gave a false result. The bookkeeping
/// alone: tests/cluster/test_audit.cpp; with every fault at once: test_simulation.cpp.

#include "pathscope/session/checkpoint.hpp"

#include "silence.hpp"
#include "staged_cluster.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr std::uint64_t k_secret = 5;

StagedCluster::Adjust audits(double share) {
    return [share](ClientConfig& config, RenderSettings&) { config.audit = {share, k_secret}; };
}

bool always(const Round&) { return true; }

}  // namespace

TEST_CASE("over a wire that loses bits, honest servers pass audits, and liars do not") {
    const Silence silence;
    for (const WireFormat wire : {WireFormat::exact, WireFormat::half, WireFormat::shared}) {
        CAPTURE(name_of(wire));
        const auto adjust = [wire](ClientConfig& config, RenderSettings& settings) {
            config.audit = {1, k_secret};
            settings.wire = wire;
        };
        // With one server, the client gives each second opinion; with two, they give them to each other.
        for (const int servers : {1, 2}) {
            StagedCluster stage(64, adjust);
            for (int i = 0; i < servers; ++i) stage.add_server();
            REQUIRE(stage.pass_until([&] { return stage.client().complete(); }));
            CHECK(stage.store().total(Counter::rounds_audited) == stage.committed());
            CHECK(stage.store().total(Counter::audits_differing) == 0);
            CHECK(stage.picture_is_right() == (wire == WireFormat::exact));  // Else nothing was rounded.
        }
        StagedCluster stage(64, adjust);
        stage.add_server().lies = always;
        REQUIRE(stage.pass_until([&] { return stage.client().complete(); }));
        CHECK(stage.store().total(Counter::audits_differing) > 0);
        CHECK(stage.store().total(Counter::banned) == 1);
        CHECK(stage.store().total(Counter::rounds_undone) > 0);
        CHECK(stage.picture_is_right());  // The client alone loses no bits.
    }
}

TEST_CASE("who gave a false result under one number loses what it gave under another") {
    const Silence silence;
    // 64 blocks of 4 rounds; a tenth is audited.
    const auto adjust = [](ClientConfig& config, RenderSettings& settings) {
        config.audit = {0.1, k_secret};
        settings.width = settings.height = 64;
    };
    StagedCluster stage(8, adjust);
    const Audit oracle({0.1, k_secret});
    const auto audited = [&](const Round& round) { return oracle.chosen({round.block, round.first / 2}); };
    stage.add_server("honest");
    StagedCluster::Server& first = stage.add_server("liar");
    std::set<std::uint32_t> spoilt_before, given_after;
    first.lies = [&](const Round& round) {  // As if it knew what nobody looks at.
        if (audited(round)) return false;
        spoilt_before.insert(round.block);
        return true;
    };
    REQUIRE(stage.pass_until([&] { return stage.committed() > 64; }));
    first.leave();
    stage.pass(10 * k_millisecond_ns);

    StagedCluster::Server& second = stage.add_server("liar");
    second.lies = [&](const Round& round) {
        given_after.insert(round.block);
        return audited(round);
    };
    REQUIRE(stage.pass_until([&] { return stage.client().complete(); }));
    CHECK(stage.store().total(Counter::audits_differing) > 0);
    CHECK(stage.store().server(ServerId{3})->total(Counter::banned) == 1);
    // Else what is undone for the second number would do.
    CHECK_FALSE(
        std::includes(given_after.begin(), given_after.end(), spoilt_before.begin(), spoilt_before.end()));
    CHECK(stage.picture_is_right());
}

TEST_CASE("who is there under two numbers does not judge itself") {
    const Silence silence;
    StagedCluster stage(64, audits(1));
    for (int i = 0; i < 2; ++i) stage.add_server("liar").lies = always;
    REQUIRE(stage.pass_until([&] { return stage.client().complete(); }));
    CHECK(stage.store().total(Counter::banned) == 2);
    CHECK(stage.client().progress().servers_known == 0);
    CHECK(stage.picture_is_right());
}

TEST_CASE("a result that was on its way when its block was undone is refused, and is no offence") {
    const Silence silence;
    StagedCluster stage(256, audits(1));
    StagedCluster::Server& liar = stage.add_server("liar");
    StagedCluster::Server& honest = stage.add_server("honest");
    REQUIRE(stage.pass_until([&] { return stage.committed() > 8; }));
    honest.hears_cancel = false;
    liar.lies = always;
    REQUIRE(stage.pass_until([&] { return stage.store().total(Counter::rounds_undone) > 0; }));
    REQUIRE(stage.store().total(Counter::refused_results) == 0);
    REQUIRE(stage.pass_until([&] { return stage.client().complete(); }));
    CHECK(stage.store().total(Counter::refused_results) > 0);
    CHECK(stage.client().conduct().points(conduct_name("", "honest", ""), stage.now()) == 0);
    CHECK(stage.picture_is_right());
}

TEST_CASE(
    "what was counted for light that is taken back is what counters have risen by beyond their totals") {
    const Silence silence;
    StagedCluster stage(64, audits(1));
    stage.add_server("honest");
    stage.add_server("liar").lies = [](const Round& round) { return round.first >= 16; };
    CounterTotals before{};
    bool fell = false;
    const auto watch = [&] {
        const CounterTotals ever = stage.store().totals_ever();
        for (std::size_t i = 0; i < k_counters; ++i) fell |= ever[i] < before[i];
        before = ever;
        return stage.client().complete();
    };
    REQUIRE(stage.pass_until(watch));
    CHECK_FALSE(fell);
    const std::uint64_t undone = stage.store().total(Counter::rounds_undone);
    CHECK(undone > 0);
    const auto at = [](Counter counter) { return std::size_t(counter); };
    CHECK(before[at(Counter::rounds_committed)] == stage.committed() + undone);
    CHECK(stage.store().total(Counter::rounds_committed) == stage.committed());
    CHECK(before[at(Counter::banned)] == stage.store().total(Counter::banned));
}

TEST_CASE("an adaptive frame that begins anew keeps the mark that its checkpoint had, and no other") {
    const Silence silence;
    const auto adjust = [](ClientConfig& config, RenderSettings& settings) {
        config.relaxed = true;
        config.audit = {1, k_secret};
        config.sampling.adaptive = true;
        settings.direct_spp = 8;
    };
    BitsIdentity other = own_bits();
    ++other.golden[0];

    // An earlier run, in which a server of other bits took part.
    StagedCluster earlier(64, adjust);
    earlier.add_server("foreign", other);
    REQUIRE(earlier.pass_until([&] { return earlier.committed() >= 10; }));
    const std::uint64_t marked = earlier.client().differing_rounds();
    REQUIRE(marked > 0);
    Checkpoint checkpoint;
    checkpoint.work = identity_of(earlier.client().state(), earlier.client().work().plan());
    checkpoint.history.runs = 1;
    checkpoint.history.differing_rounds = marked;
    earlier.client().work().snapshot(checkpoint.frame);
    const auto file = CheckpointFile::parse(encode_checkpoint(checkpoint), "f.ck");
    REQUIRE(file);

    StagedCluster stage(64, adjust);
    REQUIRE(stage.client().resume(*file));
    CHECK(stage.client().differing_rounds() == marked);
    StagedCluster::Server& liar = stage.add_server("liar");
    stage.add_server("foreign", other);
    REQUIRE(stage.pass_until([&] { return stage.client().differing_rounds() > marked; }));
    liar.lies = always;
    REQUIRE(stage.pass_until([&] { return stage.client().epoch() == Epoch{2}; }));
    CHECK(stage.client().differing_rounds() == marked);
    REQUIRE(stage.pass_until([&] { return stage.client().complete(); }));
    CHECK(stage.picture_is_right());
    CHECK(stage.client().differing_rounds() > marked);
    CHECK(stage.client().differing_rounds() ==
          marked + stage.store().server(ServerId{2})->total(Counter::differing_rounds));
}

TEST_CASE("a result so late that its lease is forgotten is dropped, and is no offence of whoever was slow") {
    const Silence silence;
    StagedCluster stage(
        2, [](ClientConfig&, RenderSettings& settings) { settings.width = settings.height = 8; });
    std::vector<StagedCluster::Server*> servers;
    for (int i = 0; i < 14; ++i) {
        servers.push_back(&stage.add_server());
        servers.back()->renders = false;  // Whoever is given the only round is late with it.
    }
    const Ledger& ledger = stage.client().work().indirect_ledger();
    const auto is_forgotten = [&](std::size_t i) {
        if (servers[i]->leases.empty()) return false;
        const message::Lease& lease = servers[i]->leases.back();
        return ledger.judge({lease.lease, lease.epoch, lease.unit, lease.first, lease.count,
                             ServerId{std::uint32_t(i) + 1}}) == Verdict::forgotten;
    };
    std::size_t slow = 0;
    REQUIRE(stage.pass_until(
        [&] {
            for (slow = 0; slow < servers.size() && !is_forgotten(slow);) ++slow;
            return slow < servers.size();
        },
        600 * k_second_ns));
    const std::uint64_t refused = stage.store().total(Counter::refused_results);
    servers[slow]->renders = true;
    REQUIRE(stage.pass_until([&] { return stage.store().total(Counter::refused_results) > refused; }));
    CHECK(stage.client().conduct().points(conduct_name("", fmt::format("server-{}", slow + 1), ""),
                                          stage.now()) == 0);
    CHECK(stage.committed() == 0);
    for (StagedCluster::Server* server : servers) server->renders = true;
    REQUIRE(stage.pass_until([&] { return stage.client().complete(); }));
    CHECK(stage.picture_is_right());
}
