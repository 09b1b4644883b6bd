/// The real state machines of client and servers against thousands of seeded worlds (simulated_cluster.hpp).
///
///     PATHSCOPE_SEED=17 build/release/test_session -tc="*whatever the network*"       one world, again
///     PATHSCOPE_SEEDS=100000 ...                                                      more of them
///     PATHSCOPE_DAMAGE=20 ...                                 a bit flips in so many of a hundred messages
///     PATHSCOPE_UNTIL_BROKEN=1 ...                            none is begun once one broke

#include <fmt/format.h>

#include <atomic>
#include <cstdlib>
#include <mutex>
#include <string>

#include "pathscope/cluster/credit_policy.hpp"
#include "pathscope/core/parallel_for.hpp"

#include "silence.hpp"
#include "simulated_cluster.hpp"

#include "log_capture.hpp"
#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

std::uint32_t number_from_environment(const char* name) {
    const char* const text = std::getenv(name);
    return text == nullptr ? 0 : std::uint32_t(std::strtoul(text, nullptr, 10));
}

}  // namespace

TEST_CASE("whatever the network does and whoever dies, every sample is in the picture once") {
    const LogCapture quiet;
    const std::uint32_t chosen = number_from_environment("PATHSCOPE_SEED");
    const std::uint32_t asked = number_from_environment("PATHSCOPE_SEEDS");
    const std::uint32_t damage = number_from_environment("PATHSCOPE_DAMAGE");
    const bool until_broken = number_from_environment("PATHSCOPE_UNTIL_BROKEN") != 0;
    const std::uint32_t seeds = asked != 0 ? asked : k_sanitized ? 200 : 10'000;
    const std::uint32_t first = chosen != 0 ? chosen : 1;
    const int count = chosen != 0 ? 1 : int(seeds);

    ClusterTotals all;
    std::string failures;
    std::atomic<int> failed = 0;
    std::mutex mutex;
    parallel_for(count, 0, [&](int i) {
        if (until_broken && failed > 0) return;
        ClusterSettings settings = ClusterSettings::from_seed(first + std::uint32_t(i));
        if (damage != 0) settings.damage = float(damage) / 100;
        SimulatedCluster cluster(settings);
        const std::string failure = cluster.run();
        const std::lock_guard lock(mutex);
        all.add(cluster.totals());
        if (!failure.empty() && ++failed <= 5)
            failures += fmt::format("seed {} ({}): {}\n", settings.seed, settings.describe(), failure);
    });
    CHECK_MESSAGE(failed.load() == 0, failed.load(), " of ", count, " worlds broke:\n", failures);

    const LedgerCounts& c = all.ledger;
    MESSAGE(fmt::format(
        "{} worlds, {} events, {} messages, {:.0f} s of virtual time; messages: {} lost, {} "
        "doubled, {} damaged, {} "
        "parted, {} unreachable, {} refused; processes: {} killed, {} frozen, {} parted, {} "
        "hung ({} seen stuck), {} drained, {} joined, {} "
        "pauses and {} restarts of the client, {} new states, {} given up, {} banned, {} failures; {} of "
        "other bits refused, {} images marked; {} lies, "
        "{} rounds audited, {} unmasked, {} undone; {} faults of relays, {} rounds by them; leases: {} "
        "granted, "
        "{} expired, {} "
        "revoked, {} released, {} superseded, {} dropped, {} copied, {} reallocated; results: {} "
        "accepted ({} late) with {} rounds, "
        "{} duplicate, {} stale, {} forgotten",
        count, all.events, all.messages, to_seconds(all.virtual_time), all.lost, all.doubled, all.damaged,
        all.parted, all.unreachable, all.bad_messages, all.kills, all.freezes, all.partitions, all.hangs,
        all.stuck, all.drains, all.joins, all.pauses, all.restarts, all.new_states, all.deaths, all.bans,
        all.failures, all.refused_bits, all.marked_images, all.lies, all.audited, all.unmasked, all.undone,
        all.relay_faults, all.relayed, c.granted, c.expired, c.revoked, c.released, c.superseded, c.dropped,
        c.copied, c.reallocated, c.accepted, c.late, c.rounds_accepted, c.duplicates, c.stale, c.forgotten));
    if (count < 2000) return;
    CHECK(c.rounds_accepted > c.accepted + c.accepted / 20);  // Leases of several rounds are no exception.
    CHECK(all.most_leases > 2 * k_least_credits);  // Wires are slow at times, and rounds are short.
    // The simulation is worth its name only if everything does happen in it.
    for (const std::uint64_t happened :
         {all.hangs,      all.stuck,        all.refused_bits, all.marked_images, all.lost,     all.doubled,
          all.damaged,    all.parted,       all.unreachable,  all.bad_messages,  all.kills,    all.freezes,
          all.partitions, all.drains,       all.joins,        all.pauses,        all.restarts, all.new_states,
          all.deaths,     all.bans,         all.failures,     all.lies,          all.audited,  all.unmasked,
          all.undone,     all.relay_faults, all.relayed,      c.expired,         c.revoked,    c.released,
          c.superseded,   c.dropped,        c.copied,         c.reallocated,     c.late,       c.duplicates,
          c.stale,        c.forgotten})
        CHECK(happened >= 5);
}

TEST_CASE("a server that answers and gets nowhere is seen, and its work is done without it") {
    const LogCapture quiet;
    ClusterSettings settings;
    settings.seed = 1;
    settings.servers = 1;
    settings.spp = 100;
    settings.calm_at = 0;
    SimulatedCluster alone(settings);  // By the client, which believes that it has a server.
    alone.plan_hang(k_second_ns, 1000 * k_second_ns);
    CHECK(alone.run().find("would give work to 0") != std::string::npos);  // It hangs to the end.
    CHECK(alone.totals().stuck == 1);
    CHECK(alone.totals().ledger.revoked + alone.totals().ledger.expired > 0);
    CHECK(alone.totals().virtual_time < 60 * k_second_ns);

    settings.spp = 5000;
    SimulatedCluster again(settings);  // By both, when it comes to again.
    again.plan_hang(k_second_ns, 12 * k_second_ns);
    CHECK(again.run() == "");
    CHECK(again.totals().stuck == 1);
}

TEST_CASE("an honest server is not called stuck, however slow it is") {
    const LogCapture quiet;
    for (const DetectorKind detector : {DetectorKind::adaptive, DetectorKind::fixed}) {
        ClusterSettings settings;
        settings.seed = 3;
        settings.servers = 3;
        settings.min_servers = 1;
        settings.detector = detector;
        settings.samples_per_second = 8;  // A round may take half a minute.
        settings.calm_at = 0;
        SimulatedCluster cluster(settings);
        CHECK(cluster.run() == "");
        CHECK(cluster.totals().stuck == 0);
    }
}
