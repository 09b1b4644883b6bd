#include "pathscope/cluster/ledger.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

ResultClaim claim_of(const Lease& lease) {
    return {lease.id, lease.epoch, lease.unit, lease.first, lease.count, lease.server};
}

UnitReason reason_of(Verdict refusal) {
    switch (refusal) {
        case Verdict::duplicate:
            return UnitReason::duplicate;
        case Verdict::stale_epoch:
            return UnitReason::stale_epoch;
        case Verdict::mismatched:
            return UnitReason::mismatched;
        default:
            return UnitReason::unknown_lease;
    }
}

}  // namespace

SampleRange samples_of_round(const LedgerPlan& plan, RoundKey round) {
    CHECK(round.index < plan.rounds_of(round.unit), round.index, plan.samples, plan.round_samples);
    const std::uint32_t size = plan.round_samples_of(round.unit);
    const std::uint32_t first = round.index * size;
    return {plan.first_sample(round.unit) + first, std::min(size, plan.samples - first)};
}

// -- Epochs and checkpoints ---------------------------------------------------------------------------------

std::vector<Lease> Ledger::new_epoch(const LedgerPlan& plan, TimeNs now) {
    CHECK(plan.epoch > plan_.epoch, plan.epoch, plan_.epoch);
    CHECK(plan.round_samples > 0 && plan.samples <= k_open_ended, plan.round_samples, plan.samples);
    CHECK(plan.staged || plan.group_units == 0, plan.group_units);
    CHECK(plan.group_units == 0 || plan.samples <= plan.group_samples, plan.samples, plan.group_samples);
    std::vector<Lease> dropped = outstanding_leases();
    for (const Lease& lease : dropped) note(lease, UnitChange::closed, UnitReason::new_epoch, now);
    counts_.dropped += dropped.size();

    plan_ = plan;
    stopped_ = false;
    const std::uint32_t open_at_first = plan.staged ? 0 : plan.rounds_per_unit();
    units_.assign(plan.units, Unit{open_at_first, 0, 0, {}});
    open_ = std::uint64_t{plan.units} * open_at_first;
    active_.clear();
    records_.clear();
    deadlines_.clear();
    held_.clear();
    reopened_.clear();
    outstanding_ = 0;
    committed_ = begun_ = restored_ = 0;
    accepted_before_ = counts_.accepted;
    undone_before_ = counts_.undone;
    last_lease_before_ = last_lease_;
    if (!plan.open_ended()) count(Counter::rounds, rounds(), k_local_server);
    return dropped;
}

void Ledger::open(std::uint32_t unit, std::uint32_t rounds) {
    std::uint32_t& open = units_.at(unit).open;
    CHECK(plan_.staged && rounds >= open && rounds <= plan_.rounds_of(unit), rounds, open);
    open_ += rounds - open;
    count(Counter::rounds, rounds - open, k_local_server);
    open = rounds;
}

std::uint32_t Ledger::samples_before(std::uint32_t unit, std::uint32_t rounds) const {
    if (rounds == 0) return 0;
    const SampleRange last = samples_of_round(plan_, {unit, rounds - 1});
    return last.first + last.count - plan_.first_sample(unit);
}

Result<void> Ledger::restore(std::uint32_t unit, const UnitSnapshot& snapshot) {
    if (unit >= plan_.units)
        return bad_input(
            fmt::format("The checkpoint has a unit {}, the plan only {} units.", unit, plan_.units));
    if (units_[unit].fresh != 0)
        return bad_input(fmt::format("The checkpoint has unit {} twice, or work on it has begun.", unit));
    const bool rising = std::adjacent_find(snapshot.missing.begin(), snapshot.missing.end(),
                                           std::greater_equal<>()) == snapshot.missing.end();
    if (snapshot.reached > units_[unit].open || !rising ||
        (!snapshot.missing.empty() && snapshot.missing.back() >= snapshot.reached))
        return bad_input(fmt::format("The checkpoint's rounds of unit {} do not fit the plan.", unit));

    Unit& account = units_[unit];
    account.fresh = snapshot.reached;
    account.samples = samples_before(unit, snapshot.reached);
    for (const std::uint32_t index : snapshot.missing) {
        account.samples -= samples_of_round(plan_, {unit, index}).count;
        active_[{unit, index}];
        reopened_.push_back({unit, index});
    }
    const std::uint64_t committed = snapshot.reached - snapshot.missing.size();
    committed_ += committed;
    restored_ += committed;
    begun_ += snapshot.reached;
    if (plan_.open_ended()) count(Counter::rounds, snapshot.reached, k_local_server);
    count(Counter::rounds_committed, committed, k_local_server);
    return {};
}

UnitSnapshot Ledger::snapshot(std::uint32_t unit) const {
    UnitSnapshot snapshot{units_.at(unit).fresh, {}};
    for (auto it = active_.lower_bound({unit, 0}); it != active_.end() && it->first.unit == unit; ++it)
        snapshot.missing.push_back(it->first.index);
    return snapshot;
}

std::size_t Ledger::undo(std::uint32_t unit, const UnitSnapshot& kept, TimeNs now) {
    Unit& account = units_.at(unit);
    std::size_t undone = 0;
    for (std::uint32_t index = 0; index < account.fresh; ++index) {
        const RoundKey round{unit, index};
        const bool is_kept =
            index < kept.reached && !std::binary_search(kept.missing.begin(), kept.missing.end(), index);
        if (is_kept || !committed(round)) continue;
        const SampleRange samples = samples_of_round(plan_, round);
        active_[round];
        reopened_.push_back(round);
        account.samples -= samples.count;
        note({{}, plan_.epoch, unit, samples.first, samples.count, {}, now, now}, UnitChange::reopened,
             UnitReason::undone, now);
        ++undone;
    }
    committed_ -= undone;
    counts_.undone += undone;
    return undone;
}

// -- Granting -----------------------------------------------------------------------------------------------

std::optional<Lease> Ledger::grant(ServerId server, RoundKey round, TimeNs now, TimeNs duration) {
    if (stopped_ || round.unit >= plan_.units) return std::nullopt;
    Unit& unit = units_[round.unit];
    if (round.index == unit.fresh && round.index < unit.open) {
        ++unit.fresh;
        ++begun_;
        if (plan_.open_ended()) count(Counter::rounds, 1, k_local_server);
        return hold(active_[round], server, round, now, duration, UnitReason::fresh);
    }

    const auto found = active_.find(round);
    if (found == active_.end() || found->second.holders > 0) return std::nullopt;
    Active& active = found->second;
    close_again(round);
    if (active.attempts == 0) return hold(active, server, round, now, duration, UnitReason::fresh);
    const bool moved = active.last_holder != server;
    if (moved) {
        ++counts_.reallocated;
        count(Counter::reallocated, 1, server);
    }
    return hold(active, server, round, now, duration, moved ? UnitReason::reallocated : UnitReason::retried);
}

std::optional<Lease> Ledger::grant_copy(ServerId server, RoundKey round, TimeNs now, TimeNs duration) {
    const auto found = active_.find(round);
    if (stopped_ || found == active_.end()) return std::nullopt;
    Active& active = found->second;
    if (active.holders == 0 || active.holders >= k_holders_per_round) return std::nullopt;
    for (const LeaseId id : active.leases) {
        const Record& record = records_.at(id);
        if (record.outstanding && record.lease.server == server) return std::nullopt;
    }
    ++counts_.copied;
    count(Counter::speculated, 1, server);
    return hold(active, server, round, now, duration, UnitReason::straggler);
}

Lease Ledger::hold(Active& active, ServerId server, RoundKey round, TimeNs now, TimeNs duration,
                   UnitReason reason) {
    CHECK(duration > 0, duration);
    if (active.leases.size() == k_leases_per_round) forget_one_ended(active);
    const bool copy = reason == UnitReason::straggler;
    const SampleRange samples = samples_of_round(plan_, round);
    const Lease lease{
        LeaseId{++last_lease_}, plan_.epoch, round.unit, samples.first, samples.count, server, now,
        now + duration,         copy};
    records_.emplace(lease.id, Record{lease});
    deadlines_.emplace(lease.deadline, lease.id);
    ++held_[server];
    ++outstanding_;
    ++counts_.granted;
    count(Counter::leases_granted, 1, server);
    note(lease, copy ? UnitChange::copied : UnitChange::granted, reason, now, active.last_holder);

    active.leases.push_back(lease.id);
    ++active.attempts;
    ++active.holders;
    active.last_holder = server;
    units_[round.unit].owner = server;
    return lease;
}

// The oldest lease has computed longest, so that its result is the likeliest to come; that of a lost server
// is the least likely.
void Ledger::forget_one_ended(Active& active) {
    auto victim = active.leases.end();
    for (auto it = active.leases.begin(); it != active.leases.end(); ++it) {
        const Record& record = records_.at(*it);
        if (record.outstanding) continue;
        victim = it;
        if (record.revoked) break;
    }
    CHECK(victim != active.leases.end());
    records_.erase(*victim);
    active.leases.erase(victim);
}

// -- Results ------------------------------------------------------------------------------------------------

Verdict Ledger::judge(const ResultClaim& claim) const {
    if (claim.epoch < plan_.epoch) return Verdict::stale_epoch;
    if (claim.epoch > plan_.epoch || claim.lease.value == 0 || claim.lease.value > last_lease_)
        return Verdict::unknown;
    if (claim.lease.value <= last_lease_before_)
        return Verdict::mismatched;  // an old lease in a new epoch's name

    if (const auto found = records_.find(claim.lease); found != records_.end())
        return claim == claim_of(found->second.lease) ? Verdict::accepted : Verdict::mismatched;

    const RoundKey round = round_at(claim.unit, claim.first);
    if (round.unit >= plan_.units || round.index >= units_[round.unit].open ||
        samples_of_round(plan_, round) != SampleRange{claim.first, claim.count})
        return Verdict::mismatched;
    return committed(round) ? Verdict::duplicate : Verdict::unknown;
}

Commit Ledger::commit(const ResultClaim& claim, TimeNs now) {
    Commit commit{judge(claim), false, 0, {}};
    ++counts_.received;
    if (commit.verdict != Verdict::accepted) {
        refuse(commit.verdict, claim, now);
        return commit;
    }

    Record& record = records_.at(claim.lease);
    const Lease lease = record.lease;
    const RoundKey round = key_of(lease);
    Active& active = active_.at(round);
    if (active.holders == 0) close_again(round);
    commit.late = !record.outstanding;
    commit.since_grant = now - lease.granted;
    if (commit.late) {
        ++counts_.late;
    } else {
        ++counts_.returned;
        end(record);
    }
    for (const LeaseId id : active.leases) {
        Record& other = records_.at(id);
        if (!other.outstanding) continue;
        ++counts_.superseded;
        end(other);
        note(other.lease, UnitChange::closed, UnitReason::superseded, now);
        commit.superseded.push_back(other.lease);
    }
    // Without a record the round counts as committed from here on.
    for (const LeaseId id : active.leases) records_.erase(id);
    active_.erase(round);

    ++committed_;
    units_[lease.unit].samples += lease.count;
    ++counts_.accepted;
    note(lease, UnitChange::committed, commit.late ? UnitReason::late_result : UnitReason::result, now);
    count(Counter::rounds_committed, 1, lease.server);
    return commit;
}

void Ledger::refuse(Verdict verdict, const ResultClaim& claim, TimeNs now) {
    Counter counter = Counter::refused_results;
    switch (verdict) {
        case Verdict::duplicate:
            ++counts_.duplicates;
            counter = Counter::duplicates_dropped;
            break;
        case Verdict::stale_epoch:
            ++counts_.stale;
            counter = Counter::stale_dropped;
            break;
        case Verdict::mismatched:
            ++counts_.mismatched;
            break;
        default:
            ++counts_.unknown;
            break;
    }
    count(counter, 1, claim.server);
    const Lease named{claim.lease,  claim.epoch, claim.unit, claim.first, claim.count,
                      claim.server, now,         now,        false};
    note(named, UnitChange::refused, reason_of(verdict), now);
}

// -- Ends without a result ----------------------------------------------------------------------------------

std::vector<Lease> Ledger::expire(TimeNs now) {
    std::vector<Lease> ended;
    while (!deadlines_.empty() && deadlines_.begin()->first <= now) {
        Record& record = records_.at(deadlines_.begin()->second);
        ended.push_back(record.lease);
        end_without_result(record, UnitReason::lease_expired, now);
        ++counts_.expired;
        count(Counter::leases_expired, 1, ended.back().server);
    }
    return ended;
}

std::vector<Lease> Ledger::revoke(ServerId server, TimeNs now) {
    std::vector<Lease> ended;
    if (!held_.contains(server)) return ended;
    for (auto& [id, record] : records_) {
        if (!record.outstanding || record.lease.server != server) continue;
        record.revoked = true;
        ended.push_back(record.lease);
        end_without_result(record, UnitReason::server_lost, now);
        ++counts_.revoked;
    }
    return ended;
}

std::optional<Lease> Ledger::release(LeaseId id, ServerId server, TimeNs now) {
    const auto found = records_.find(id);
    if (found == records_.end() || !found->second.outstanding || found->second.lease.server != server)
        return std::nullopt;
    const Lease lease = found->second.lease;
    end_without_result(found->second, UnitReason::released, now);
    ++counts_.released;
    // It said that no result will come, so that there is nothing to wait for.
    std::erase(active_.at(key_of(lease)).leases, id);
    records_.erase(found);
    return lease;
}

void Ledger::end(Record& record) {
    record.outstanding = false;
    deadlines_.erase({record.lease.deadline, record.lease.id});
    const auto held = held_.find(record.lease.server);
    if (--held->second == 0) held_.erase(held);
    --outstanding_;
    --active_.at(key_of(record.lease)).holders;
}

void Ledger::end_without_result(Record& record, UnitReason reason, TimeNs now) {
    end(record);
    const RoundKey round = key_of(record.lease);
    const bool reopens = active_.at(round).holders == 0;
    if (reopens) reopened_.push_back(round);
    note(record.lease, reopens ? UnitChange::reopened : UnitChange::closed, reason, now);
}

/// A reopened round is held or committed: it waits no more.
void Ledger::close_again(RoundKey round) {
    const auto found = std::find(reopened_.begin(), reopened_.end(), round);
    CHECK(found != reopened_.end(), round.unit, round.index);
    reopened_.erase(found);
}

// -- View ---------------------------------------------------------------------------------------------------

bool Ledger::committed(RoundKey round) const {
    return round.index < units_[round.unit].fresh && !active_.contains(round);
}

bool Ledger::complete() const {
    if (stopped_) return outstanding_ == 0;
    return committed_ == open_;
}

std::optional<RoundKey> Ledger::next_fresh(std::uint32_t unit) const {
    const std::uint32_t index = units_.at(unit).fresh;
    if (stopped_ || index >= units_[unit].open) return std::nullopt;
    return RoundKey{unit, index};
}

std::uint32_t Ledger::attempts(RoundKey round) const {
    const auto found = active_.find(round);
    return found == active_.end() ? 0 : found->second.attempts;
}

std::vector<Lease> Ledger::outstanding_leases() const {
    std::vector<Lease> leases;
    leases.reserve(outstanding_);
    for (const auto& [id, record] : records_)
        if (record.outstanding) leases.push_back(record.lease);
    return leases;
}

std::size_t Ledger::outstanding(ServerId server) const {
    const auto found = held_.find(server);
    return found == held_.end() ? 0 : found->second;
}

std::optional<Lease> Ledger::oldest_uncopied(ServerId not_of) const {
    for (const auto& [id, record] : records_)
        if (record.outstanding && record.lease.server != not_of &&
            active_.at(key_of(record.lease)).holders == 1)
            return record.lease;
    return std::nullopt;
}

std::optional<Lease> Ledger::find(LeaseId lease) const {
    const auto found = records_.find(lease);
    if (found == records_.end() || !found->second.outstanding) return std::nullopt;
    return found->second.lease;
}

std::optional<TimeNs> Ledger::next_deadline() const {
    if (deadlines_.empty()) return std::nullopt;
    return deadlines_.begin()->first;
}

std::uint64_t Ledger::rounds() const { return plan_.open_ended() ? begun_ : open_; }

// -- Audit --------------------------------------------------------------------------------------------------

Result<void> Ledger::audit() const {
    for (const auto check : {&Ledger::audit_balances, &Ledger::audit_records, &Ledger::audit_units})
        if (Result<void> found = (this->*check)(); !found) return found;
    return {};
}

Result<void> Ledger::audit_balances() const {
    const LedgerCounts& c = counts_;
    const std::uint64_t ended = c.returned + c.superseded + c.released + c.expired + c.revoked + c.dropped;
    if (c.granted != outstanding_ + ended)
        return failed(fmt::format("Ledger: {} leases were granted, but {} are outstanding and {} ended.",
                                  c.granted, outstanding_, ended));
    const std::uint64_t judged = c.accepted + c.duplicates + c.stale + c.unknown + c.mismatched;
    if (c.received != judged)
        return failed(fmt::format("Ledger: {} results came, but {} were judged.", c.received, judged));
    if (c.accepted != c.returned + c.late)
        return failed(fmt::format("Ledger: {} results were accepted, but {} came in time and {} late.",
                                  c.accepted, c.returned, c.late));
    const std::uint64_t booked = c.accepted - accepted_before_ + restored_ - (c.undone - undone_before_);
    if (committed_ != booked)
        return failed(
            fmt::format("Ledger: {} rounds are committed, but {} results were booked.", committed_, booked));
    return {};
}

Result<void> Ledger::audit_records() const {
    std::size_t known = 0, holders = 0, open = 0;
    for (const auto& [round, active] : active_) {
        std::size_t outstanding = 0;
        for (const LeaseId id : active.leases) {
            const auto record = records_.find(id);
            if (record == records_.end() || key_of(record->second.lease) != round)
                return failed(
                    fmt::format("Ledger: lease {} of unit {} has no record.", id.value, round.unit));
            outstanding += record->second.outstanding ? 1 : 0;
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
        known += active.leases.size();
        holders += active.holders;
        open += active.holders == 0 ? 1 : 0;
    }
    std::size_t held = 0;
    for (const auto& [server, leases] : held_) held += leases;
    if (known != records_.size() || open != reopened_.size() || holders != outstanding_ ||
        held != outstanding_ || deadlines_.size() != outstanding_)
        return failed(fmt::format(
            "Ledger: {} records for {} leases, {} waiting of {}; outstanding {}, {} held by "
            "rounds, {} by servers, {} deadlines.",
            records_.size(), known, reopened_.size(), open, outstanding_, holders, held, deadlines_.size()));
    return {};
}

Result<void> Ledger::audit_units() const {
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

void Ledger::note(const Lease& lease, UnitChange change, UnitReason reason, TimeNs now,
                  ServerId previous) const {
    if (store_ == nullptr || !store_->keeps_events()) return;
    store_->record({now, 0, k_local_server, 0,
                    UnitEvent{lease.epoch, lease.unit, lease.first, lease.count, lease.id, lease.server,
                              previous, change, reason}});
}

void Ledger::count(Counter counter, std::uint64_t n, ServerId server) const {
    if (store_ != nullptr) store_->count(counter, n, server);
}

}  // namespace pathscope
