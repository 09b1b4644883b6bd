#pragma once
/// The ledger: the client's exactly-once account of rounds.
///
/// The work of an epoch is a number of units (with strategy `blocks` a unit is a block of pixels; the ledger
/// does not know). Each unit needs the samples [0, samples) once, cut into rounds of round_samples; the last
/// may be shorter. A round is *granted* to a server as a lease with a deadline, alone or with those that follow it
/// (cluster/lease_size.hpp), and *committed* by the first result that fits, or granted again when the lease ends
/// without one:
///
///                 grant                       commit
///        fresh  --------->  held by 1..2  -------------->  committed
///                            |      ^
///            expire, revoke, |      | grant
///            release         v      |        commit (a late result is welcome)
///                            reopened  ----------------->  committed
///
/// Invariants, which check_invariants() recomputes from the records at any moment:
///   rounds    each is committed at most once; when complete(), exactly once
///   leases    granted = outstanding + returned + superseded + released + expired + revoked + dropped
///   results   received = accepted + duplicates + stale + unknown + forgotten + mismatched
///   between   accepted = returned + late;  committed = rounds of accepted results + restored - undone
///   runs      a result is taken whole or not at all: it has no round that is committed already;
///             two leases that are outstanding and share a round have all their rounds in common
///   bounded   records exist only for rounds that were granted and are not committed, at most
///             k_leases_per_round each; a committed round is remembered by what is *absent*
///
/// Stages: the rounds of a staged plan are opened bit by bit, unit by unit, by open(); the account is complete whenever
/// all that are open are committed. Its units come in groups of equal size, whose samples are numbered apart, so that
/// the same block can be several units (cluster/adaptive.hpp); only the first group has rounds of round_samples, all
/// others go sample by sample.
///
/// How a duplicate is known without a record of it: a unit's rounds are first granted in rising order, so
/// `index < fresh` means "was granted", and without a record, "is committed".
///
/// No socket, no clock (`now` is an argument and never falls). If there is an event store, every decision is
/// recorded there with its reason, and counted (rounds, leases, refused results; who merges counts samples,
/// tiles and latency). Cost: O(r log n) per call, r = rounds of the lease, n = leases known; a reopened round is found in
/// O(those waiting); revoke, undo and new_epoch O(n).
/// Thread safety: one thread at a time.
/// Test: tests/cluster/test_ledger.cpp, test_simulation.cpp

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "pathscope/core/clock.hpp"
#include "pathscope/core/enum_names.hpp"
#include "pathscope/core/ids.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/probe/event_store.hpp"

namespace pathscope {

/// As many samples as one exact sum can hold: "until stop()".
inline constexpr std::uint32_t k_open_ended = 1u << 20;

struct LedgerPlan {
    Epoch epoch;
    std::uint32_t units = 0;
    std::uint32_t samples = 0;        ///< Per unit; k_open_ended to go on until stop().
    std::uint32_t round_samples = 1;  ///< At least 1.
    // Staged plans only.
    bool staged = false;              ///< No round is open at first.
    std::uint32_t group_units = 0;    ///< Units of one group; 0 = all are one.
    std::uint32_t group_samples = 0;  ///< The samples of group i are numbered from i * group_samples on.

    [[nodiscard]] bool open_ended() const { return samples == k_open_ended; }
    [[nodiscard]] std::uint32_t rounds_per_unit() const { return rounds_of(0); }
    [[nodiscard]] std::uint32_t group_of(std::uint32_t unit) const {
        return group_units == 0 ? 0 : unit / group_units;
    }
    [[nodiscard]] std::uint32_t first_sample(std::uint32_t unit) const {
        return group_of(unit) * group_samples;
    }
    [[nodiscard]] std::uint32_t round_samples_of(std::uint32_t unit) const {
        return group_of(unit) == 0 ? round_samples : 1;
    }
    /// The most rounds that a unit can have.
    [[nodiscard]] std::uint32_t rounds_of(std::uint32_t unit) const {
        const std::uint32_t size = round_samples_of(unit);
        return samples / size + (samples % size != 0 ? 1 : 0);
    }
};

/// Round `index` of `unit`.
struct RoundKey {
    std::uint32_t unit = 0;
    std::uint32_t index = 0;
    auto operator<=>(const RoundKey&) const = default;
};

/// That round and those that follow it in its unit, so many in all.
struct RoundRun {
    RoundKey first;
    std::uint32_t rounds = 1;

    explicit RoundRun(RoundKey begin, std::uint32_t size = 1) : first(begin), rounds(size) {}
    [[nodiscard]] RoundKey at(std::uint32_t i) const { return {first.unit, first.index + i}; }
    [[nodiscard]] bool contains(RoundKey round) const {
        return round.unit == first.unit && round.index - first.index < rounds;
    }
};

struct SampleRange {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    bool operator==(const SampleRange&) const = default;
};

/// Requires: the rounds are in the plan, at least one.
[[nodiscard]] SampleRange samples_of(const LedgerPlan& plan, const RoundRun& run);
[[nodiscard]] inline SampleRange samples_of_round(const LedgerPlan& plan, RoundKey round) {
    return samples_of(plan, RoundRun(round));
}

/// How long the client's own renderer may hold a round: if it is gone, so is the account.
inline constexpr TimeNs k_no_deadline = TimeNs{1} << 61;

/// Rounds granted to one server until a deadline.
struct Lease {
    LeaseId id;
    Epoch epoch;
    std::uint32_t unit = 0;
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    ServerId server;
    TimeNs granted = 0;
    TimeNs deadline = 0;
    bool copy = false;  ///< A second lease on a straggler's rounds.
};

/// What a result says it is; the ledger believes nothing of it.
struct ResultClaim {
    LeaseId lease;
    Epoch epoch;
    std::uint32_t unit = 0;
    std::uint32_t first = 0;
    std::uint32_t count = 0;
    ServerId server;  ///< From the connection it came by, not from the message.

    bool operator==(const ResultClaim&) const = default;
};

enum class Verdict {
    accepted,     ///< Merge it: the first result of its rounds.
    duplicate,    ///< One of its rounds was committed already.
    stale_epoch,  ///< Of an old epoch.
    unknown,      ///< No such lease was granted.
    forgotten,  ///< Of a lease that was given back, or ended so long ago that its round remembers only later ones.
    mismatched,  ///< Another unit, range or server than its lease says.
};

inline constexpr std::array k_verdict_names{
    EnumName{Verdict::accepted, "accepted"},       EnumName{Verdict::duplicate, "duplicate"},
    EnumName{Verdict::stale_epoch, "stale_epoch"}, EnumName{Verdict::unknown, "unknown"},
    EnumName{Verdict::forgotten, "forgotten"},     EnumName{Verdict::mismatched, "mismatched"},
};
constexpr const auto& enum_table(Verdict) { return k_verdict_names; }

/// Where a result that is not accepted is counted.
[[nodiscard]] Counter refusal_counter(Verdict refusal);

struct Commit {
    Verdict verdict = Verdict::unknown;
    bool late = false;              ///< Accepted after its lease had ended.
    TimeNs since_grant = 0;         ///< Of an accepted one.
    std::uint32_t rounds = 0;       ///< That it brought.
    std::vector<Lease> superseded;  ///< Leases with a round of it, which nobody needs any more: cancel them.
};

/// Everything that was ever counted, over all epochs.
struct LedgerCounts {
    // Leases: each granted one is outstanding or has met exactly one of these ends.
    std::uint64_t granted = 0;
    std::uint64_t returned = 0;    ///< Its result was accepted in time.
    std::uint64_t superseded = 0;  ///< Another's result was first.
    std::uint64_t released = 0;
    std::uint64_t expired = 0;
    std::uint64_t revoked = 0;
    std::uint64_t dropped = 0;  ///< Its epoch ended.
    // Results: each received one has met exactly one of these verdicts.
    std::uint64_t received = 0;
    std::uint64_t accepted = 0;
    std::uint64_t duplicates = 0;
    std::uint64_t stale = 0;
    std::uint64_t unknown = 0;
    std::uint64_t forgotten = 0;
    std::uint64_t mismatched = 0;
    // Among them.
    std::uint64_t late = 0;             ///< Accepted after the lease had ended.
    std::uint64_t rounds_accepted = 0;  ///< Of accepted results.
    std::uint64_t reallocated = 0;      ///< Granted again, to another server than the last.
    std::uint64_t copied = 0;           ///< Granted as a second lease.
    std::uint64_t undone = 0;           ///< Committed rounds that were opened again.
};

/// What a checkpoint keeps of a unit: the rounds [0, reached) are committed, except the missing ones.
struct UnitSnapshot {
    std::uint32_t reached = 0;
    std::vector<std::uint32_t> missing;  ///< Rising.
};

class Ledger {
  public:
    static constexpr std::size_t k_leases_per_round = 8;   ///< Remembered, ended ones included.
    static constexpr std::size_t k_holders_per_round = 2;  ///< Outstanding at once.

    /// The store is where decisions and counters go; it may be null, and must outlive the ledger.
    explicit Ledger(EventStore* store = nullptr) : store_(store) {}

    /// Starts an account; everything of older epochs is dropped. Returns the leases that were outstanding.
    /// Requires: plan.epoch above the epoch before; samples <= k_open_ended.
    std::vector<Lease> new_epoch(const LedgerPlan& plan, TimeNs now);

    /// Takes over what a checkpoint says is committed. Returns an error if it does not fit the plan.
    /// Requires: nothing of this unit was granted or restored before.
    [[nodiscard]] Result<void> restore(std::uint32_t unit, const UnitSnapshot& committed);
    [[nodiscard]] UnitSnapshot snapshot(std::uint32_t unit) const;

    /// Opens rounds of a staged plan: the unit shall have so many in all. Requires: no fewer than before, and at most
    /// plan().rounds_of(unit).
    void open(std::uint32_t unit, std::uint32_t rounds);

    /// Opens the committed rounds of a unit again, but for those that are `kept`: what they brought is not believed any more,
    /// and whoever merged it takes it back. Returns how many.
    std::size_t undo(std::uint32_t unit, const UnitSnapshot& kept, TimeNs now);

    /// A number for a lease that is no round's of this account.
    [[nodiscard]] LeaseId new_lease_id() { return LeaseId{++last_lease_}; }

    /// No more grants; results of leases already granted are still welcome.
    void stop() { stopped_ = true; }

    /// The open rounds from this one on, at most so many, that one lease may hold: fresh ones, or reopened ones that
    /// the same server held last. None if it is not open itself.
    [[nodiscard]] RoundRun grantable(RoundKey first, std::uint32_t most) const;

    /// Grants open rounds: reopened ones, or the unit's next fresh ones. Returns nothing if they are not grantable().
    /// Requires: duration > 0.
    std::optional<Lease> grant(ServerId server, const RoundRun& run, TimeNs now, TimeNs duration);
    std::optional<Lease> grant(ServerId server, RoundKey round, TimeNs now, TimeNs duration) {
        return grant(server, RoundRun(round), now, duration);
    }

    /// Grants what another server holds with this round, so that the quicker one counts. Returns nothing unless
    /// exactly one other server holds it.
    std::optional<Lease> grant_copy(ServerId server, RoundKey round, TimeNs now, TimeNs duration);

    /// What commit() would answer: lets a session refuse before it decodes, and decode before it commits.
    [[nodiscard]] Verdict judge(const ResultClaim& claim) const;

    /// Books a result. The caller merges it if and only if the verdict is `accepted`.
    Commit commit(const ResultClaim& claim, TimeNs now);

    /// Ends the leases whose deadline is at or before now, and reopens their rounds.
    std::vector<Lease> expire(TimeNs now);

    /// Ends the leases of a server that died or left, and reopens their rounds.
    std::vector<Lease> revoke(ServerId server, TimeNs now);

    /// Ends one lease that its server gave back, or whose result could not be used. Returns nothing if the
    /// server does not hold it.
    std::optional<Lease> release(LeaseId lease, ServerId server, TimeNs now);

    // -- View (schedules, panels, statistics) ---------------------------------------------------------------
    [[nodiscard]] const LedgerPlan& plan() const { return plan_; }
    [[nodiscard]] bool stopped() const { return stopped_; }
    /// Wraps around to an index that no plan has if `first` lies before the unit's samples.
    [[nodiscard]] RoundKey round_at(std::uint32_t unit, std::uint32_t first) const {
        return {unit, (first - plan_.first_sample(unit)) / plan_.round_samples_of(unit)};
    }
    /// Nothing if these samples are not a number of whole rounds of the plan.
    [[nodiscard]] std::optional<RoundRun> rounds_in(std::uint32_t unit, SampleRange samples) const;
    [[nodiscard]] RoundRun rounds_of(const Lease& lease) const;

    /// Rounds that may be granted or were; grows only by open().
    [[nodiscard]] std::uint64_t rounds_open() const { return open_; }
    [[nodiscard]] std::uint32_t rounds_open(std::uint32_t unit) const { return units_.at(unit).open; }

    /// Nothing is left to wait for: all open rounds are committed or, after stop(), no lease is outstanding.
    [[nodiscard]] bool complete() const;

    /// The unit's lowest round that was never granted.
    [[nodiscard]] std::optional<RoundKey> next_fresh(std::uint32_t unit) const;

    /// Open rounds that nobody holds; open-ended: more than there will ever be time for.
    [[nodiscard]] std::uint64_t rounds_waiting() const { return open_ - begun_ + reopened_.size(); }

    /// Rounds whose leases ended without a result, in that order: to be given out before any fresh one.
    [[nodiscard]] const std::deque<RoundKey>& reopened() const { return reopened_; }

    /// How often the round was granted so far; 0 for a fresh or a committed one. For longer leases each time.
    [[nodiscard]] std::uint32_t attempts(RoundKey round) const;

    /// Outstanding leases by rising id, that is, oldest first.
    [[nodiscard]] std::vector<Lease> outstanding_leases() const;
    [[nodiscard]] std::size_t outstanding() const { return outstanding_; }
    [[nodiscard]] std::size_t outstanding(ServerId server) const;
    /// The oldest outstanding lease of other servers whose rounds nobody else holds.
    [[nodiscard]] std::optional<Lease> oldest_uncopied(ServerId not_of) const;
    [[nodiscard]] std::optional<Lease> find(LeaseId lease) const;  ///< Outstanding ones only.

    /// The next moment at which expire() has something to do.
    [[nodiscard]] std::optional<TimeNs> next_deadline() const;

    [[nodiscard]] std::uint64_t rounds() const;  ///< Open in this epoch; open-ended: begun.
    [[nodiscard]] std::uint64_t rounds_committed() const { return committed_; }
    [[nodiscard]] std::uint32_t samples_committed(std::uint32_t unit) const {
        return units_.at(unit).samples;
    }
    [[nodiscard]] ServerId last_owner(std::uint32_t unit) const { return units_.at(unit).owner; }
    [[nodiscard]] const LedgerCounts& counts() const { return counts_; }

    /// Recomputes every invariant above from the records; an error is a bug, and says which one broke.
    [[nodiscard]] Result<void> check_invariants() const;

  private:
    struct Unit {
        std::uint32_t open = 0;     ///< Rounds [0, open) may be granted.
        std::uint32_t fresh = 0;    ///< Rounds [0, fresh) were granted or restored.
        std::uint32_t samples = 0;  ///< Committed.
        ServerId owner;             ///< Of the newest lease.
    };
    struct Record {
        Lease lease;
        bool outstanding = true;
        bool revoked = false;
    };
    /// A round that was granted and is not committed.
    struct Active {
        std::vector<LeaseId> leases;  ///< Outstanding and ended ones, rising.
        std::uint32_t attempts = 0;
        std::uint32_t holders = 0;  ///< Outstanding ones among `leases`; 0: the round is reopened.
        ServerId last_holder;
    };

    [[nodiscard]] bool committed(RoundKey round) const;
    [[nodiscard]] std::uint32_t samples_before(std::uint32_t unit, std::uint32_t rounds) const;
    Lease hold(ServerId server, const RoundRun& run, TimeNs now, TimeNs duration, UnitReason reason);
    void forget_one_ended(const Active& active);
    void forget(LeaseId lease);
    [[nodiscard]] std::vector<LeaseId> others_beside(const Lease& lease, const RoundRun& run) const;
    void supersede(LeaseId lease, const RoundRun& by, Commit& commit, TimeNs now);
    void refuse(Verdict verdict, const ResultClaim& claim, TimeNs now);
    void end(Record& record);
    void note_holders(const Active& active);
    void end_without_result(Record& record, UnitReason reason, TimeNs now);
    void close_again(RoundKey round);
    [[nodiscard]] Result<void> check_balances() const;
    [[nodiscard]] Result<void> check_rounds() const;
    [[nodiscard]] Result<void> check_leases() const;
    [[nodiscard]] Result<void> check_units() const;
    void note(const Lease& lease, UnitChange change, UnitReason reason, TimeNs now,
              ServerId previous = {}) const;
    void count(Counter counter, std::uint64_t n, ServerId server) const;

    EventStore* store_;
    LedgerPlan plan_;
    bool stopped_ = false;
    std::vector<Unit> units_;
    std::map<RoundKey, Active> active_;
    std::map<LeaseId, Record> records_;
    std::set<std::pair<TimeNs, LeaseId>> deadlines_;  ///< Of outstanding leases.
    std::set<LeaseId> uncopied_;                      ///< Outstanding, and nobody else holds their rounds.
    std::map<ServerId, std::uint32_t> held_;          ///< Outstanding leases by server, no zeros.
    std::deque<RoundKey> reopened_;
    std::size_t outstanding_ = 0;
    std::uint64_t open_ = 0;       ///< Of all units.
    std::uint64_t committed_ = 0;  ///< Rounds of this epoch.
    std::uint64_t begun_ = 0;
    std::uint64_t restored_ = 0;
    std::uint64_t accepted_before_ = 0;  ///< counts_.rounds_accepted when this epoch began.
    std::uint64_t undone_before_ = 0;    ///< counts_.undone then.
    std::uint64_t last_lease_ = 0;
    std::uint64_t last_lease_before_ = 0;  ///< last_lease_ when this epoch began.
    LedgerCounts counts_;
};

}  // namespace pathscope
