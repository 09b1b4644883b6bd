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

Counter refusal_counter(Verdict refusal) {
    switch (refusal) {
        case Verdict::duplicate:
            return Counter::duplicates_dropped;
        case Verdict::stale_epoch:
            return Counter::stale_dropped;
        default:
            return Counter::refused_results;
    }
}

SampleRange samples_of(const LedgerPlan& plan, const RoundRun& run) {
    const auto [unit, index] = run.first;
    const std::uint32_t in_all = plan.rounds_of(unit);
    CHECK(run.rounds > 0 && index < in_all && run.rounds <= in_all - index, index, run.rounds, in_all);
    const std::uint32_t size = plan.round_samples_of(unit);
    const std::uint32_t first = index * size;
    // The product fits: it is at most that of a round more than all samples.
    return {plan.first_sample(unit) + first, std::min(run.rounds * size, plan.samples - first)};
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
    uncopied_.clear();
    held_.clear();
    reopened_.clear();
    outstanding_ = 0;
    committed_ = begun_ = restored_ = 0;
    accepted_before_ = counts_.rounds_accepted;
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
    return samples_of(plan_, RoundRun({unit, 0}, rounds)).count;
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

RoundRun Ledger::grantable(RoundKey first, std::uint32_t most) const {
    if (stopped_ || first.unit >= plan_.units) return RoundRun(first, 0);
    const Unit& unit = units_[first.unit];
    if (first.index >= unit.fresh)
        return RoundRun(first, first.index == unit.fresh ? std::min(most, unit.open - unit.fresh) : 0);
    RoundRun run(first, 0);
    ServerId last_holder;
    for (auto it = active_.find(first); run.rounds < most && it != active_.end(); ++it) {
        if (run.rounds == 0) last_holder = it->second.last_holder;
        const bool follows = it->first == run.at(run.rounds);
        if (!follows || it->second.holders > 0 || it->second.last_holder != last_holder) break;
        ++run.rounds;
    }
    return run;
}

std::optional<Lease> Ledger::grant(ServerId server, const RoundRun& run, TimeNs now, TimeNs duration) {
    if (run.rounds == 0 || grantable(run.first, run.rounds).rounds < run.rounds) return std::nullopt;
    Unit& unit = units_[run.first.unit];
    if (run.first.index == unit.fresh) {
        unit.fresh += run.rounds;
        begun_ += run.rounds;
        if (plan_.open_ended()) count(Counter::rounds, run.rounds, k_local_server);
        return hold(server, run, now, duration, UnitReason::fresh);
    }

    for (std::uint32_t i = 0; i < run.rounds; ++i) close_again(run.at(i));
    const Active& first = active_.at(run.first);
    if (first.attempts == 0) return hold(server, run, now, duration, UnitReason::fresh);
    const bool moved = first.last_holder != server;
    if (moved) {
        ++counts_.reallocated;
        count(Counter::reallocated, 1, server);
    }
    return hold(server, run, now, duration, moved ? UnitReason::reallocated : UnitReason::retried);
}

std::optional<Lease> Ledger::grant_copy(ServerId server, RoundKey round, TimeNs now, TimeNs duration) {
    const auto found = active_.find(round);
    if (stopped_ || found == active_.end()) return std::nullopt;
    const Active& active = found->second;
    if (active.holders == 0 || active.holders >= k_holders_per_round) return std::nullopt;
    const Lease* held = nullptr;
    for (const LeaseId id : active.leases)
        if (const Record& record = records_.at(id); record.outstanding) held = &record.lease;
    if (held->server == server) return std::nullopt;
    ++counts_.copied;
    count(Counter::speculated, 1, server);
    return hold(server, rounds_of(*held), now, duration, UnitReason::straggler);
}

Lease Ledger::hold(ServerId server, const RoundRun& run, TimeNs now, TimeNs duration, UnitReason reason) {
    CHECK(duration > 0, duration);
    const bool copy = reason == UnitReason::straggler;
    const auto [unit, index] = run.first;
    const SampleRange samples = samples_of(plan_, run);
    const Lease lease{LeaseId{++last_lease_}, plan_.epoch, unit, samples.first, samples.count, server, now,
                      now + duration,         copy};
    const ServerId previous = active_[run.first].last_holder;
    for (std::uint32_t i = 0; i < run.rounds; ++i) {
        Active& active = active_[run.at(i)];
        if (active.leases.size() == k_leases_per_round) forget_one_ended(active);
        active.leases.push_back(lease.id);
        ++active.attempts;
        ++active.holders;
        active.last_holder = server;
    }
    records_.emplace(lease.id, Record{lease});
    deadlines_.emplace(lease.deadline, lease.id);
    ++held_[server];
    ++outstanding_;
    ++counts_.granted;
    count(Counter::leases_granted, 1, server);
    note_holders(active_.at(run.first));
    note(lease, copy ? UnitChange::copied : UnitChange::granted, reason, now, previous);
    units_[unit].owner = server;
    return lease;
}

// The oldest lease has computed longest, so that its result is the likeliest to come; that of a lost server
// is the least likely.
void Ledger::forget_one_ended(const Active& active) {
    std::optional<LeaseId> victim;
    for (const LeaseId id : active.leases) {
        const Record& record = records_.at(id);
        if (record.outstanding) continue;
        victim = id;
        if (record.revoked) break;
    }
    CHECK(victim);
    forget(*victim);
}

/// Its result would be `forgotten` from here on, or a duplicate.
void Ledger::forget(LeaseId lease) {
    const auto found = records_.find(lease);
    const RoundRun run = rounds_of(found->second.lease);
    for (std::uint32_t i = 0; i < run.rounds; ++i) std::erase(active_.at(run.at(i)).leases, lease);
    records_.erase(found);
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

    const auto run = rounds_in(claim.unit, {claim.first, claim.count});
    if (!run || run->first.index + run->rounds > units_[claim.unit].open) return Verdict::mismatched;
    const std::uint32_t fresh = units_[claim.unit].fresh;  // From there on none is committed.
    for (std::uint32_t i = 0; i < run->rounds && run->at(i).index < fresh; ++i)
        if (committed(run->at(i))) return Verdict::duplicate;
    return Verdict::forgotten;
}

Commit Ledger::commit(const ResultClaim& claim, TimeNs now) {
    Commit commit{judge(claim), false, 0, 0, {}};
    ++counts_.received;
    if (commit.verdict != Verdict::accepted) {
        refuse(commit.verdict, claim, now);
        return commit;
    }

    Record& record = records_.at(claim.lease);
    const Lease lease = record.lease;
    const RoundRun run = rounds_of(lease);
    commit.late = !record.outstanding;
    commit.since_grant = now - lease.granted;
    commit.rounds = run.rounds;
    for (std::uint32_t i = 0; i < run.rounds; ++i)
        if (active_.at(run.at(i)).holders == 0) close_again(run.at(i));
    if (commit.late) {
        ++counts_.late;
    } else {
        ++counts_.returned;
        end(record);
    }
    for (const LeaseId other : others_beside(lease, run)) supersede(other, run, commit, now);
    // Without a record the rounds count as committed from here on.
    forget(lease.id);
    for (std::uint32_t i = 0; i < run.rounds; ++i) active_.erase(run.at(i));

    committed_ += run.rounds;
    units_[lease.unit].samples += lease.count;
    ++counts_.accepted;
    counts_.rounds_accepted += run.rounds;
    note(lease, UnitChange::committed, commit.late ? UnitReason::late_result : UnitReason::result, now);
    count(Counter::rounds_committed, run.rounds, lease.server);
    return commit;
}

/// Other leases of any of these rounds, each once.
std::vector<LeaseId> Ledger::others_beside(const Lease& lease, const RoundRun& run) const {
    std::vector<LeaseId> others;
    for (std::uint32_t i = 0; i < run.rounds; ++i)
        for (const LeaseId id : active_.at(run.at(i)).leases)
            if (id != lease.id) others.push_back(id);
    std::sort(others.begin(), others.end());
    others.erase(std::unique(others.begin(), others.end()), others.end());
    return others;
}

/// A lease that another's result overtook. What it holds beyond that result's rounds, which can be only if that one was
/// late, has to be granted again: its own result, of all its rounds, is of no use.
void Ledger::supersede(LeaseId id, const RoundRun& by, Commit& commit, TimeNs now) {
    Record& record = records_.at(id);
    const Lease lease = record.lease;
    const RoundRun run = rounds_of(lease);
    const bool was_outstanding = record.outstanding;
    if (was_outstanding) {
        ++counts_.superseded;
        end(record);
        note(lease, UnitChange::closed, UnitReason::superseded, now);
        commit.superseded.push_back(lease);
    }
    forget(id);
    for (std::uint32_t i = 0; was_outstanding && i < run.rounds; ++i) {
        const RoundKey round = run.at(i);
        if (by.contains(round) || active_.at(round).holders > 0) continue;
        reopened_.push_back(round);
        const SampleRange samples = samples_of_round(plan_, round);
        note({{}, plan_.epoch, round.unit, samples.first, samples.count, {}, now, now}, UnitChange::reopened,
             UnitReason::superseded, now);
    }
}

void Ledger::refuse(Verdict verdict, const ResultClaim& claim, TimeNs now) {
    switch (verdict) {
        case Verdict::duplicate:
            ++counts_.duplicates;
            break;
        case Verdict::stale_epoch:
            ++counts_.stale;
            break;
        case Verdict::mismatched:
            ++counts_.mismatched;
            break;
        case Verdict::forgotten:
            ++counts_.forgotten;
            break;
        default:
            ++counts_.unknown;
            break;
    }
    count(refusal_counter(verdict), 1, claim.server);
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
    forget(id);  // It said that no result will come, so that there is nothing to wait for.
    return lease;
}

void Ledger::end(Record& record) {
    record.outstanding = false;
    deadlines_.erase({record.lease.deadline, record.lease.id});
    const auto held = held_.find(record.lease.server);
    if (--held->second == 0) held_.erase(held);
    --outstanding_;
    uncopied_.erase(record.lease.id);
    const RoundRun run = rounds_of(record.lease);
    for (std::uint32_t i = 0; i < run.rounds; ++i) --active_.at(run.at(i)).holders;
    note_holders(active_.at(run.first));
}

/// The first round of a lease has got a holder, or lost one, as have the others: which of its leases may be copied?
void Ledger::note_holders(const Active& active) {
    for (const LeaseId id : active.leases)
        if (records_.at(id).outstanding && active.holders == 1)
            uncopied_.insert(id);
        else
            uncopied_.erase(id);
}

void Ledger::end_without_result(Record& record, UnitReason reason, TimeNs now) {
    end(record);
    const RoundRun run = rounds_of(record.lease);
    const bool reopens = active_.at(run.first).holders == 0;  // Else all of them have the same other holder.
    for (std::uint32_t i = 0; reopens && i < run.rounds; ++i) reopened_.push_back(run.at(i));
    note(record.lease, reopens ? UnitChange::reopened : UnitChange::closed, reason, now);
}

/// A reopened round is held or committed: it waits no more.
void Ledger::close_again(RoundKey round) {
    const auto found = std::find(reopened_.begin(), reopened_.end(), round);
    CHECK(found != reopened_.end(), round.unit, round.index);
    reopened_.erase(found);
}

// -- View ---------------------------------------------------------------------------------------------------

std::optional<RoundRun> Ledger::rounds_in(std::uint32_t unit, SampleRange samples) const {
    if (unit >= plan_.units || samples.count == 0) return std::nullopt;
    const std::uint32_t size = plan_.round_samples_of(unit);
    const RoundRun run(round_at(unit, samples.first), (samples.count - 1) / size + 1);
    const std::uint32_t in_all = plan_.rounds_of(unit);
    if (run.first.index >= in_all || run.rounds > in_all - run.first.index) return std::nullopt;
    return samples_of(plan_, run) == samples ? std::optional(run) : std::nullopt;
}

RoundRun Ledger::rounds_of(const Lease& lease) const {
    const auto run = rounds_in(lease.unit, {lease.first, lease.count});
    CHECK(run, lease.unit, lease.first, lease.count);
    return *run;
}

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
    for (const LeaseId id : uncopied_)
        if (const Lease& lease = records_.at(id).lease; lease.server != not_of) return lease;
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
