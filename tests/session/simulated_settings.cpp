#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "simulated_cluster.hpp"

namespace pathscope::testing {

ClusterSettings ClusterSettings::from_seed(std::uint32_t seed) {
    HashRng rng(seed);
    const auto below = [&](std::uint32_t n) { return rng.next_u32() % n; };
    const auto often = [&](std::uint32_t one_in) { return below(one_in) == 0; };
    ClusterSettings s;
    s.seed = seed;
    s.servers = int(often(50) ? 20 + below(60) : below(7));
    if (seed % 1000 == 0) s.servers = seed % 10'000 == 0 ? 1000 : int(100 + below(100));
    s.most_servers = s.servers + int(below(6));
    s.width = 3 + int(below(14));
    s.height = 3 + int(below(10));
    s.block = 2 + int(below(6));
    s.spp = 1 + below(12);
    s.direct_spp = 1 + below(3);
    s.round_samples = 1 + below(4);
    s.schedule = k_schedule_names[below(k_schedule_names.size())].value;
    s.detector = often(4) ? DetectorKind::fixed : DetectorKind::adaptive;
    s.min_servers = often(3) ? 1 : 0;
    s.samples_per_second = std::exp2(7 + 6.0 * rng.next_float());
    s.lose = often(2) ? 0.2f * rng.next_float() : 0;
    s.duplicate = often(2) ? 0.2f * rng.next_float() : 0;
    s.damage = often(3) ? 0.1f * rng.next_float() : 0;
    s.faults_per_second = often(4) ? 0 : 3.0 * rng.next_float();
    s.new_states = int(below(3));
    s.restarts = often(5) ? 1 : 0;
    s.calm_at = from_seconds(2 + 8 * rng.next_float());
    s.differing = often(6) ? 0.5f * rng.next_float() : 0;
    s.relaxed = often(2);
    if (s.servers >= 100) {  // A crowd: what matters is that it is one.
        s.detector = DetectorKind::adaptive;
        s.faults_per_second *= 5;
        s.width = s.height = 24;
        s.new_states = 1;
        s.calm_at = 2 * k_second_ns;
    }
    if (often(3)) s.audit = often(2) ? 1 : 0.3;
    if (often(4)) s.incapable = 1;
    if (often(2)) {
        s.liars = 1 + int(below(2));
        s.lie = often(2) ? 0.01f : 0.3f * rng.next_float();
    }
    if (often(3)) {  // Many rounds in a lease.
        s.lease_time = from_seconds(4 * rng.next_float());
        s.spp *= 2 + below(6);
        s.round_samples = 1;
    }
    if (often(4)) s.relays = 1 + int(below(3));
    return s;
}

std::string ClusterSettings::describe() const {
    return fmt::format(
        "{} servers, {} relays, {}x{} in blocks of {}, {}+{} samples in rounds of {}, leases of {:.2f} s, "
        "{}, {}, at "
        "least {}, lose {:.2f}, "
        "duplicate {:.2f}, damage {:.2f}, {:.1f} faults/s, {} states, {} restarts, {:.2f} of other bits {}, "
        "calm at {:.1f} s, {} liars of {:.2f}, {} incapable, {:.1f} audited",
        servers, relays, width, height, block, spp, direct_spp, round_samples, to_seconds(lease_time),
        name_of(schedule), name_of(detector), min_servers, lose, duplicate, damage, faults_per_second,
        new_states, restarts, differing, relaxed ? "admitted" : "refused", to_seconds(calm_at), liars, lie,
        incapable, audit);
}

void ClusterTotals::add(const ClusterTotals& other) {
    events += other.events;
    messages += other.messages;
    lost += other.lost;
    doubled += other.doubled;
    damaged += other.damaged;
    parted += other.parted;
    unreachable += other.unreachable;
    kills += other.kills;
    freezes += other.freezes;
    partitions += other.partitions;
    hangs += other.hangs;
    stuck += other.stuck;
    refused_bits += other.refused_bits;
    marked_images += other.marked_images;
    drains += other.drains;
    joins += other.joins;
    pauses += other.pauses;
    restarts += other.restarts;
    new_states += other.new_states;
    bad_messages += other.bad_messages;
    deaths += other.deaths;
    most_leases = std::max(most_leases, other.most_leases);
    bans += other.bans;
    lies += other.lies;
    audited += other.audited;
    relay_faults += other.relay_faults;
    relayed += other.relayed;
    unmasked += other.unmasked;
    undone += other.undone;
    failures += other.failures;
    virtual_time += other.virtual_time;
    ledger.granted += other.ledger.granted;
    ledger.accepted += other.ledger.accepted;
    ledger.late += other.ledger.late;
    ledger.rounds_accepted += other.ledger.rounds_accepted;
    ledger.duplicates += other.ledger.duplicates;
    ledger.stale += other.ledger.stale;
    ledger.unknown += other.ledger.unknown;
    ledger.forgotten += other.ledger.forgotten;
    ledger.mismatched += other.ledger.mismatched;
    ledger.superseded += other.ledger.superseded;
    ledger.released += other.ledger.released;
    ledger.expired += other.ledger.expired;
    ledger.revoked += other.ledger.revoked;
    ledger.dropped += other.ledger.dropped;
    ledger.reallocated += other.ledger.reallocated;
    ledger.copied += other.ledger.copied;
}

}  // namespace pathscope::testing
