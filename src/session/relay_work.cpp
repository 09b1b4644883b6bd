#include "pathscope/session/relay_work.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace pathscope {
namespace {

constexpr Epoch k_account_epoch{1};  ///< An account lives as long as its lease, and has one epoch.

}  // namespace

// ---- Above.

std::uint32_t RelayWork::round_samples(const RoundJob& job) const {
    if (job.settings.filter == FilterPlace::server) return job.round.count;
    const double area = double(job.round.rect.area());
    const double wanted = speed_.per_second() * to_seconds(k_relayed_round_time) / area;
    const auto most = std::uint32_t(std::clamp(wanted, 1.0, double(job.round.count)));
    const std::uint32_t size = speed_.measured() ? most : std::min(k_first_relayed_round, job.round.count);
    const std::uint32_t rounds = (job.round.count + size - 1) / size;
    return (job.round.count + rounds - 1) / rounds;
}

void RelayWork::begin(RoundJob job, TimeNs now) {
    CHECK(jobs_.empty() || job.ticket > jobs_.rbegin()->first, job.ticket);
    Job work{std::move(job), Ledger(store_)};
    const Round& round = work.asked.round;
    const std::uint32_t samples = round_samples(work.asked);
    work.ledger.new_epoch({k_account_epoch, 1, round.count, samples}, now);
    work.result.sums.resize(std::size_t(round.rect.area()));
    usual_samples_ = double(samples) * double(round.rect.area());
    usual_rounds_ = std::uint32_t(work.ledger.rounds_open());
    rounds_open_ += work.ledger.rounds_open();
    most_pixels_ = std::max(most_pixels_, std::uint64_t(round.rect.area()));
    jobs_.emplace(work.asked.ticket, std::move(work));
}

/// Ends a job. Returns the leases below that nobody needs any more.
std::vector<Lease> RelayWork::finish(Jobs::iterator entry, bool complete) {
    Job& job = entry->second;
    std::vector<Lease> unneeded;
    for (const Lease& lease : job.ledger.outstanding_leases()) unneeded.push_back(as_known_below(job, lease));
    RoundOutcome outcome;
    outcome.ticket = job.asked.ticket;
    outcome.part = job.asked.part;
    outcome.round = job.asked.round;
    outcome.started = job.begun.value_or(0);
    outcome.duration = job.worked / TimeNs(std::max<std::size_t>(1, servers_));
    if (complete) outcome.result = std::move(job.result);
    finished_.push_back(std::move(outcome));
    for (const auto& [lease, number] : job.numbers) known_.erase(number);
    jobs_.erase(entry);
    return unneeded;
}

std::vector<Lease> RelayWork::cancel(std::uint64_t ticket, TimeNs) {
    const auto job = jobs_.find(ticket);
    return job == jobs_.end() ? std::vector<Lease>() : finish(job, false);
}

std::vector<Lease> RelayWork::cancel_all(TimeNs now) {
    std::vector<Lease> unneeded;
    while (!jobs_.empty())
        for (const Lease& lease : cancel(jobs_.begin()->first, now)) unneeded.push_back(lease);
    return unneeded;
}

void RelayWork::begin_epoch(Epoch epoch, TimeNs now) {
    CHECK(epoch > epoch_, epoch, epoch_);
    cancel_all(now);
    epoch_ = epoch;
}

// ---- Below: leases.

Lease RelayWork::as_known_below(const Job& job, Lease lease) const {
    lease.id = job.numbers.at(lease.id);
    lease.epoch = epoch_;
    lease.unit = job.asked.round.block;
    lease.first += job.asked.round.first;
    return lease;
}

Lease RelayWork::note_grant(Job& job, const Lease& lease) {
    const LeaseId number{++last_lease_};
    if (!job.begun) job.begun = lease.granted;
    job.numbers.emplace(lease.id, number);
    known_.emplace(number, Known{job.asked.ticket, lease.id});
    return as_known_below(job, lease);
}

std::optional<Lease> RelayWork::grant_indirect(ServerId server, TimeNs now, std::uint32_t most,
                                               const LeaseTime& duration) {
    const auto grant = [&](Job& job, RoundKey key) -> std::optional<Lease> {
        const RoundRun run = job.ledger.grantable(key, most);
        const Round round = in_job(job, samples_of(job.ledger.plan(), run));
        const auto lease = job.ledger.grant(server, run, now, duration(round, job.ledger.attempts(key)));
        return lease ? std::optional(note_grant(job, *lease)) : std::nullopt;
    };
    for (auto& [ticket, job] : jobs_)
        if (!job.ledger.reopened().empty()) return grant(job, job.ledger.reopened().front());
    for (auto& [ticket, job] : jobs_)
        if (const auto key = job.ledger.next_fresh(0)) return grant(job, *key);
    return std::nullopt;
}

std::optional<Lease> RelayWork::copy_straggler(ServerId server, TimeNs now, const OwnTime& own,
                                               const LeaseTime& duration) {
    for (auto& [ticket, job] : jobs_) {
        const auto round_of_lease = [&job = job](const Lease& lease) {
            return in_job(job, {lease.first, lease.count});
        };
        const auto late = pick_straggler(job.ledger, server, now, [&](const Lease& lease) {
            return own(double(round_of_lease(lease).samples()));
        });
        if (!late) continue;
        const RoundKey first = job.ledger.rounds_of(*late).first;
        const TimeNs lasts = duration(round_of_lease(*late), job.ledger.attempts(first));
        if (const auto lease = job.ledger.grant_copy(server, first, now, lasts))
            return note_grant(job, *lease);
    }
    return std::nullopt;
}

void RelayWork::release(LeaseId lease, ServerId server, TimeNs now) {
    const auto known = known_.find(lease);
    if (known == known_.end()) return;
    Job& job = jobs_.at(known->second.ticket);
    if (!job.ledger.release(known->second.lease, server, now)) return;
    // No result will come: its number need not be known any more. Whoever gives back leases for ever fills no memory.
    job.numbers.erase(known->second.lease);
    known_.erase(known);
}

std::size_t RelayWork::revoke(ServerId server, TimeNs now) {
    std::size_t revoked = 0;
    for (auto& [ticket, job] : jobs_) revoked += job.ledger.revoke(server, now).size();
    return revoked;
}

void RelayWork::expire(TimeNs now) {
    for (auto& [ticket, job] : jobs_) job.ledger.expire(now);
}

std::optional<TimeNs> RelayWork::next_deadline() const {
    std::optional<TimeNs> next;
    for (const auto& [ticket, job] : jobs_)
        if (const auto deadline = job.ledger.next_deadline())
            next = std::min(next.value_or(*deadline), *deadline);
    return next;
}

// ---- Below: results.

/// The claim in the words of the job's account; nothing if it does not fit the job at all.
std::optional<ResultClaim> RelayWork::as_booked(const Job& job, LeaseId lease,
                                                const ResultClaim& claim) const {
    const Round& asked = job.asked.round;
    if (claim.epoch != epoch_ || claim.unit != asked.block || claim.first < asked.first) return std::nullopt;
    return ResultClaim{lease, k_account_epoch, 0, claim.first - asked.first, claim.count, claim.server};
}

Verdict RelayWork::judge(const ResultClaim& claim) const {
    if (claim.epoch < epoch_) return Verdict::stale_epoch;
    if (claim.epoch > epoch_ || claim.lease.value == 0 || claim.lease.value > last_lease_)
        return Verdict::unknown;
    const auto known = known_.find(claim.lease);
    if (known == known_.end()) return Verdict::duplicate;
    const Job& job = jobs_.at(known->second.ticket);
    const auto booked = as_booked(job, known->second.lease, claim);
    return booked ? job.ledger.judge(*booked) : Verdict::mismatched;
}

Commit RelayWork::commit_indirect(const ResultClaim& claim, const RoundResult& result,
                                  std::span<const PixelSum> sums, TimeNs took, TimeNs now) {
    Commit commit;
    commit.verdict = judge(claim);
    const auto known = known_.find(claim.lease);
    const auto entry = known == known_.end() ? jobs_.end() : jobs_.find(known->second.ticket);
    const auto booked =
        entry == jobs_.end() ? std::nullopt : as_booked(entry->second, known->second.lease, claim);
    if (!booked) {
        if (store_) store_->count(refusal_counter(commit.verdict), 1, claim.server);
        return commit;
    }
    Job& job = entry->second;
    commit = job.ledger.commit(*booked, now);
    for (Lease& lease : commit.superseded) lease = as_known_below(job, lease);
    if (commit.verdict != Verdict::accepted) return commit;
    add(job, result, sums);
    // What a server says of its time is believed as far as this clock bears it out.
    const TimeNs spent = std::clamp<TimeNs>(took, 0, std::max<TimeNs>(commit.since_grant, 0));
    job.worked += spent;
    speed_.add(double(result.samples), spent);
    rounds_committed_ += commit.rounds;
    if (job.ledger.complete()) finish(entry, true);
    return commit;
}

void RelayWork::add(Job& job, const RoundResult& result, std::span<const PixelSum> sums) {
    RoundResult& all = job.result;
    CHECK(sums.size() == all.sums.size(), sums.size(), all.sums.size());
    for (std::size_t i = 0; i < sums.size(); ++i) all.sums[i] += sums[i];
    all.rays += result.rays;
    all.samples += result.samples;
    all.dropped_count += result.dropped_count;
    all.saturated_count += result.saturated_count;
    for (const DroppedSample& dropped : result.dropped)
        if (all.dropped.size() < k_max_dropped_listed) all.dropped.push_back(dropped);
}

// ---- View.

Round RelayWork::round_of(const Lease& lease) const {
    const Round& asked = jobs_.at(known_.at(lease.id).ticket).asked.round;
    return {asked.block, asked.rect, lease.first, lease.count};
}

PixelRect RelayWork::rect_of(const ResultClaim& claim) const {
    return jobs_.at(known_.at(claim.lease).ticket).asked.round.rect;
}

std::size_t RelayWork::outstanding() const {
    std::size_t leases = 0;
    for (const auto& [ticket, job] : jobs_) leases += job.ledger.outstanding();
    return leases;
}

std::size_t RelayWork::outstanding(ServerId server) const {
    std::size_t leases = 0;
    for (const auto& [ticket, job] : jobs_) leases += job.ledger.outstanding(server);
    return leases;
}

std::uint64_t RelayWork::rounds_waiting() const {
    std::uint64_t rounds = 0;
    for (const auto& [ticket, job] : jobs_) rounds += job.ledger.rounds_waiting();
    return rounds;
}

bool RelayWork::any_reopened() const {
    return std::any_of(jobs_.begin(), jobs_.end(),
                       [](const auto& job) { return !job.second.ledger.reopened().empty(); });
}

bool RelayWork::has_begun(std::uint64_t ticket) const {
    const auto job = jobs_.find(ticket);
    return job != jobs_.end() && job->second.begun;
}

std::uint32_t RelayWork::leases_for(std::size_t rounds) const {
    return std::uint32_t((rounds + usual_rounds_ - 1) / usual_rounds_);
}

Result<void> RelayWork::check_invariants() const {
    std::size_t numbers = 0;
    for (const auto& [ticket, job] : jobs_) {
        if (const auto sound = job.ledger.check_invariants(); !sound) return sound;
        const std::uint64_t booked =
            std::uint64_t(job.ledger.samples_committed(0)) * std::uint64_t(job.asked.round.rect.area());
        if (job.ledger.complete() || job.result.samples != booked)
            return failed(fmt::format("Relay: lease {} has {} samples in its sums and {} in its account.",
                                      ticket, job.result.samples, booked));
        numbers += job.numbers.size();
    }
    if (numbers != known_.size())
        return failed(fmt::format("Relay: {} leases were given out, {} are known.", numbers, known_.size()));
    return {};
}

}  // namespace pathscope
