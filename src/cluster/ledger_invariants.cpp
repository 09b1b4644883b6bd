#include <fmt/format.h>

#include <algorithm>

#include "pathscope/cluster/ledger.hpp"

namespace pathscope {

Result<void> Ledger::check_invariants() const {
    for (const auto check :
         {&Ledger::check_balances, &Ledger::check_rounds, &Ledger::check_leases, &Ledger::check_units})
        if (Result<void> found = (this->*check)(); !found) return found;
    return {};
}

Result<void> Ledger::check_balances() const {
    const LedgerCounts& c = counts_;
    const std::uint64_t ended = c.returned + c.superseded + c.released + c.expired + c.revoked + c.dropped;
    if (c.granted != outstanding_ + ended)
        return failed(fmt::format("Ledger: {} leases were granted, but {} are outstanding and {} ended.",
                                  c.granted, outstanding_, ended));
    const std::uint64_t judged = c.accepted + c.duplicates + c.stale + c.unknown + c.forgotten + c.mismatched;
    if (c.received != judged)
        return failed(fmt::format("Ledger: {} results came, but {} were judged.", c.received, judged));
    if (c.accepted != c.returned + c.late)
        return failed(fmt::format("Ledger: {} results were accepted, but {} came in time and {} late.",
                                  c.accepted, c.returned, c.late));
    const std::uint64_t booked =
        c.rounds_accepted - accepted_before_ + restored_ - (c.undone - undone_before_);
    if (committed_ != booked)
        return failed(
            fmt::format("Ledger: {} rounds are committed, but those of results are {}.", committed_, booked));
    return {};
}

/// What each round says of its leases is what they say themselves.
Result<void> Ledger::check_rounds() const {
    std::size_t open = 0, alone = 0;
    for (const auto& [round, active] : active_) {
        std::size_t outstanding = 0;
        std::optional<RoundRun> held;
        for (const LeaseId id : active.leases) {
            const auto record = records_.find(id);
            if (record == records_.end() || !rounds_of(record->second.lease).contains(round))
                return failed(
                    fmt::format("Ledger: lease {} of unit {} has no record.", id.value, round.unit));
            if (!record->second.outstanding) continue;
            ++outstanding;
            const RoundRun run = rounds_of(record->second.lease);
            if (held && (held->first != run.first || held->rounds != run.rounds))
                return failed(
                    fmt::format("Ledger: outstanding leases of unit {} overlap in part.", round.unit));
            held = run;
            if (uncopied_.contains(id) != (active.holders == 1))
                return failed(fmt::format("Ledger: lease {} of {} holders is {}copied.", id.value,
                                          active.holders, uncopied_.contains(id) ? "un" : ""));
            alone += active.holders == 1 && run.first == round ? 1 : 0;
        }
        if (outstanding != active.holders || active.holders > k_holders_per_round ||
            active.leases.size() > k_leases_per_round)
            return failed(
                fmt::format("Ledger: round {} of unit {} has {} leases, {} outstanding, {} counted.",
                            round.index, round.unit, active.leases.size(), outstanding, active.holders));
        const auto waiting = std::count(reopened_.begin(), reopened_.end(), round);
        if (waiting != (active.holders == 0 ? 1 : 0))
            return failed(fmt::format("Ledger: round {} of unit {} waits {} times, with {} holders.",
                                      round.index, round.unit, waiting, active.holders));
        open += active.holders == 0 ? 1 : 0;
    }
    if (uncopied_.size() != alone)
        return failed(
            fmt::format("Ledger: {} leases have one holder, {} are uncopied.", alone, uncopied_.size()));
    if (open != reopened_.size())
        return failed(
            fmt::format("Ledger: {} rounds have no holder, {} are reopened.", open, reopened_.size()));
    return {};
}

/// No lease is listed that no round knows, nor counted twice.
Result<void> Ledger::check_leases() const {
    std::size_t listed = 0, holders = 0, held = 0, recorded = 0, outstanding = 0;
    for (const auto& [round, active] : active_) {
        listed += active.leases.size();
        holders += active.holders;
    }
    for (const auto& [server, leases] : held_) held += leases;
    for (const auto& [id, record] : records_) {
        const std::size_t rounds = rounds_of(record.lease).rounds;
        recorded += rounds;
        outstanding += record.outstanding ? rounds : 0;
    }
    if (listed != recorded || holders != outstanding)
        return failed(
            fmt::format("Ledger: leases have {} rounds, and these list {}; {} are outstanding, {} held.",
                        recorded, listed, outstanding, holders));
    if (held != outstanding_ || deadlines_.size() != outstanding_)
        return failed(
            fmt::format("Ledger: {} leases are outstanding, servers hold {}, and {} have a deadline.",
                        outstanding_, held, deadlines_.size()));
    return {};
}

Result<void> Ledger::check_units() const {
    std::uint64_t committed = 0, open = 0;
    for (std::uint32_t unit = 0; unit < plan_.units; ++unit) {
        const UnitSnapshot account = snapshot(unit);
        open += units_[unit].open;
        if (account.reached > units_[unit].open)
            return failed(fmt::format("Ledger: {} rounds of unit {} were granted, but {} are open.",
                                      account.reached, unit, units_[unit].open));
        std::uint32_t samples = samples_before(unit, account.reached);
        for (const std::uint32_t index : account.missing)
            samples -= samples_of_round(plan_, {unit, index}).count;
        if (samples != units_[unit].samples)
            return failed(fmt::format("Ledger: unit {} has {} samples in its rounds, {} in its account.",
                                      unit, samples, units_[unit].samples));
        committed += account.reached - account.missing.size();
    }
    if (open != open_)
        return failed(fmt::format("Ledger: the units have {} open rounds, the account {}.", open, open_));
    if (committed != committed_)
        return failed(fmt::format("Ledger: the units hold {} committed rounds, the account {}.", committed,
                                  committed_));
    return {};
}

}  // namespace pathscope
