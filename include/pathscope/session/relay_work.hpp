#pragma once
/// The work of a relay: leases of the client above, each cut into rounds for the servers below, whose light is added up.
///
///     lease [first, first + n) of a rectangle  =  rounds [first, first + k), [first + k, first + 2k), ...
///     tile of the lease                        =  sum of the tiles of its rounds
///
/// Why the sum is right to the last bit: sums are exact (image/exact_sum.hpp), so order and grouping are free. Why each sample
/// is in it once: each lease is an account of its own (Ledger, of one unit), and a round's light is added if and only if
/// that account accepts it. A lease is answered when its account is complete, and not before.
///
///     k = what a server does in k_round_time, spread evenly; all n where servers filter, for a filter of parts is another
///
/// The servers below know leases by numbers of this relay's, in one row over all accounts. Results of leases that are over
/// are duplicates, those of epochs before are stale.
/// Rounds are given out lease after lease, reopened ones first, so that the oldest lease is answered first.
/// Figures: rays and what was dropped add up; the time of a lease is what its rounds took, divided by the servers: so its
/// samples per second are those of all servers together.
/// Bounded: leases are, by the client's credits.   Cost: O(leases) per call.
/// No clock. Thread safety: one thread at a time.   Test: tests/session/test_relay_work.cpp

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "pathscope/cluster/lease_policy.hpp"
#include "pathscope/cluster/ledger.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/probe/event_store.hpp"
#include "pathscope/session/indirect_work.hpp"
#include "pathscope/session/round_runner.hpp"

namespace pathscope {

/// Long enough to be worth its messages, short enough that a lost one costs little.
inline constexpr TimeNs k_relayed_round_time = 50 * k_millisecond_ns;
inline constexpr std::uint32_t k_first_relayed_round = 4;  ///< Samples, while no speed is known.

class RelayWork final : public IndirectWork {
  public:
    /// The store is where leases and results are counted; it may be null, and must outlive this.
    explicit RelayWork(EventStore* store = nullptr) : store_(store) {}

    // -- Above ----------------------------------------------------------------------------------------------

    /// A lease of the client above. Its outcome comes from take_finished(). Requires: a ticket above all before.
    void begin(RoundJob job, TimeNs now);
    /// Its outcome is empty. Returns the leases below that nobody needs any more; none if it is over already.
    std::vector<Lease> cancel(std::uint64_t ticket, TimeNs now);
    std::vector<Lease> cancel_all(TimeNs now);
    /// A new state below: what is in work ends without a result. Requires: above the epoch before.
    void begin_epoch(Epoch epoch, TimeNs now);
    [[nodiscard]] std::vector<RoundOutcome> take_finished() { return std::exchange(finished_, {}); }

    // -- Below: indirect_work.hpp ---------------------------------------------------------------------------
    void set_servers(std::vector<ServerShare> servers) override { servers_ = servers.size(); }
    std::optional<Lease> grant_indirect(ServerId server, TimeNs now, std::uint32_t most,
                                        const LeaseTime& duration) override;
    std::optional<Lease> copy_straggler(ServerId server, TimeNs now, const OwnTime& own,
                                        const LeaseTime& duration) override;
    [[nodiscard]] Verdict judge(const ResultClaim& claim) const override;
    Commit commit_indirect(const ResultClaim& claim, const RoundResult& result,
                           std::span<const PixelSum> sums, TimeNs took, TimeNs now) override;
    void release(LeaseId lease, ServerId server, TimeNs now) override;
    std::size_t revoke(ServerId server, TimeNs now) override;
    void expire(TimeNs now) override;
    [[nodiscard]] std::optional<TimeNs> next_deadline() const override;

    [[nodiscard]] Round round_of(const Lease& lease) const override;
    [[nodiscard]] PixelRect rect_of(const ResultClaim& claim) const override;
    [[nodiscard]] double samples_of_full_round() const override { return usual_samples_; }
    [[nodiscard]] std::uint64_t most_pixels() const override { return most_pixels_; }
    [[nodiscard]] std::size_t outstanding() const override;
    [[nodiscard]] std::size_t outstanding(ServerId server) const override;
    [[nodiscard]] std::uint64_t rounds_open() const override { return rounds_open_; }
    [[nodiscard]] std::uint64_t rounds_waiting() const override;
    [[nodiscard]] bool any_reopened() const override;
    [[nodiscard]] std::uint64_t rounds_committed() const override { return rounds_committed_; }

    // -- View -----------------------------------------------------------------------------------------------
    [[nodiscard]] std::size_t leases() const { return jobs_.size(); }  ///< Of the client above.
    [[nodiscard]] bool has_begun(std::uint64_t ticket) const;          ///< Some round of it was given out.
    [[nodiscard]] std::size_t numbers_known() const { return known_.size(); }  ///< Of leases below.
    /// Leases that are needed to have so many rounds.
    [[nodiscard]] std::uint32_t leases_for(std::size_t rounds) const;
    /// Recomputes what must hold; an error is a bug.
    [[nodiscard]] Result<void> check_invariants() const;

  private:
    /// A lease of the client above.
    struct Job {
        RoundJob asked;
        Ledger ledger;                         ///< One unit; samples counted from the lease's first.
        RoundResult result{};                  ///< So far.
        std::optional<TimeNs> begun{};         ///< When its first round was given out.
        TimeNs worked = 0;                     ///< By all servers together.
        std::map<LeaseId, LeaseId> numbers{};  ///< Of the account's leases, as servers below know them.
    };
    using Jobs = std::map<std::uint64_t, Job>;  ///< By ticket: oldest first.
    struct Known {
        std::uint64_t ticket;
        LeaseId lease;  ///< In the job's account.
    };

    [[nodiscard]] std::uint32_t round_samples(const RoundJob& job) const;
    Lease note_grant(Job& job, const Lease& lease);
    [[nodiscard]] static Round in_job(const Job& job, const SampleRange& samples) {
        const Round& asked = job.asked.round;
        return {asked.block, asked.rect, asked.first + samples.first, samples.count};
    }
    [[nodiscard]] Lease as_known_below(const Job& job, Lease lease) const;
    [[nodiscard]] std::optional<ResultClaim> as_booked(const Job& job, LeaseId lease,
                                                       const ResultClaim& claim) const;
    static void add(Job& job, const RoundResult& result, std::span<const PixelSum> sums);
    std::vector<Lease> finish(Jobs::iterator job, bool complete);

    EventStore* store_;
    Epoch epoch_{1};
    Jobs jobs_;
    std::map<LeaseId, Known> known_;  ///< Leases of the jobs at hand.
    std::uint64_t last_lease_ = 0;
    std::vector<RoundOutcome> finished_;
    std::size_t servers_ = 0;
    SpeedEstimate speed_{};  ///< Of one server.
    double usual_samples_ = 0;
    std::uint32_t usual_rounds_ = 1;  ///< Of a lease.
    std::uint64_t most_pixels_ = 0;   ///< Of a lease so far.
    std::uint64_t rounds_open_ = 0, rounds_committed_ = 0;
};

}  // namespace pathscope
