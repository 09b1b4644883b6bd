#pragma once
/// Audits: a share of the results is rendered a second time, by another server, and compared bit by bit.
///
///     chosen(first round)  <=>  hash(secret, round) < share * 2^64    so who renders cannot know which
///
///     result of A is merged        second opinion of B          the client's own, which is the truth
///        open  -------------------->  held by B  --- differs --->  disputed  --->  who differs from it lied
///         ^                            |     |                                      |
///         +--- B died, is late, ... ---+     +--- equal ---> settled <-------------+
///
/// A server that gives a false result for a part f of its rounds, chosen by itself, is not found by k of its audited rounds
/// with probability (1 - f)^k: of one false round in a hundred, 459 audited rounds leave 1 % of doubt.
/// Why the client is the arbiter: it is the one whom its user trusts. Where there is no other server, it gives the second
/// opinion as well, and then that is the verdict.
/// Why not before the merge: a picture that waits for its audits would wait for the slowest of two servers, everywhere. What
/// a liar gave is undone instead (FrameWork::undo).
/// Two servers that lie alike agree: with a share of 1 the servers must not conspire, with less they must not be many.
///
/// Pure bookkeeping: who renders, sends and bans is the session's business. Leases of audits have numbers of the ledger's
/// row (Ledger::new_lease_id) and are not in its account.
/// Bounded: an item for each chosen round that is merged and not settled.   Cost: O(log n) per call, revoke and forget O(n).
/// No clock: `now` is an argument and never falls.   Thread safety: one thread at a time.
/// Test: tests/cluster/test_audit.cpp, tests/session/test_liars.cpp, test_simulation.cpp, tests/system/test_audit.py

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "pathscope/cluster/ledger.hpp"
#include "pathscope/core/hash.hpp"

namespace pathscope {

struct AuditParams {
    double share = 0;          ///< Of rounds, 0 to 1.
    std::uint64_t secret = 0;  ///< Of the client.
};

/// A result of one or more rounds that was merged, and whose it was.
struct AuditedRound {
    RoundKey round;  ///< The first.
    SampleRange samples;
    ServerId author;
    Digest result{};             ///< Hash of it.
    std::uint32_t attempts = 0;  ///< At a second opinion, so far.
};

class Audit {
  public:
    static constexpr std::uint32_t k_attempts =
        3;  ///< Of servers at one round; then the client sees to it itself.

    explicit Audit(const AuditParams& params = {}) : params_(params) {}
    [[nodiscard]] bool enabled() const { return params_.share > 0; }

    /// A new epoch: nothing of the one before is left.
    void begin();
    [[nodiscard]] bool chosen(RoundKey round) const;

    /// A server's result was merged. True if it is to be audited.
    bool on_merged(const AuditedRound& merged);

    // -- The second opinion of a server ---------------------------------------------------------------------

    /// A round that waits for a second opinion, and is not this server's own. may_judge: whether it is another's than this
    /// author's, who may be there under several numbers; nothing = each number is another's.
    [[nodiscard]] std::optional<AuditedRound> next_for(
        ServerId server, const std::function<bool(ServerId author)>& may_judge = {}) const;
    /// Requires: a round of next_for(lease.server).
    void grant(const AuditedRound& item, const Lease& lease);
    /// Whether that is an outstanding lease of an audit, and a result of it.
    [[nodiscard]] bool holds(const ResultClaim& claim) const;
    /// Requires: an outstanding lease of an audit.
    [[nodiscard]] ServerId author_of(LeaseId lease) const { return items_.at(leases_.at(lease)).author; }
    /// True if the opinions agree; else it is for the client to judge. Requires: holds(claim).
    bool on_opinion(const ResultClaim& claim, const Digest& result);

    /// Leases that end without an opinion: their rounds wait again.
    bool release(LeaseId lease, ServerId server);
    void revoke(ServerId server);
    void expire(TimeNs now);
    [[nodiscard]] std::optional<TimeNs> next_deadline() const;

    // -- The client's own -----------------------------------------------------------------------------------

    /// A round that only the client can settle: a disputed one, one that servers did not get done, or of an author beside
    /// whom `nobody_else` is there.
    [[nodiscard]] std::optional<AuditedRound> next_for_client(
        const std::function<bool(ServerId)>& nobody_else) const;
    void grant_to_client(RoundKey round);
    void release_client(RoundKey round);
    /// Who lied, by the client's own result; nobody, if the round is none that waits for it.
    std::vector<ServerId> on_truth(RoundKey round, const Digest& result);

    /// The unit is rendered again: nothing about it is to be found out any more. Returns the leases to be cancelled.
    std::vector<Lease> forget(std::uint32_t unit);
    /// No new audit; those that nobody renders are given up.
    void stop();

    // -- View -----------------------------------------------------------------------------------------------
    [[nodiscard]] bool settled() const { return items_.empty(); }
    [[nodiscard]] std::size_t unsettled() const { return items_.size(); }
    [[nodiscard]] std::size_t outstanding() const { return leases_.size(); }  ///< Leases.
    /// Whether an opinion of this server is before the client.
    [[nodiscard]] bool disputes(ServerId server) const {
        return std::any_of(items_.begin(), items_.end(), [server](const auto& entry) {
            return entry.second.opinion && entry.second.opinion->first == server;
        });
    }

  private:
    struct Item {
        SampleRange samples;
        ServerId author;
        Digest result{};
        std::optional<Lease> lease;                            ///< Of the second opinion.
        std::optional<std::pair<ServerId, Digest>> opinion{};  ///< That differs.
        bool at_client = false;
        std::uint32_t attempts = 0;

        [[nodiscard]] bool is_for_client() const { return opinion || attempts >= k_attempts; }
        [[nodiscard]] bool open() const { return !lease && !opinion && !at_client; }
    };
    using Items = std::map<RoundKey, Item>;

    [[nodiscard]] static AuditedRound round_of(const Items::value_type& entry) {
        return {entry.first, entry.second.samples, entry.second.author, entry.second.result,
                entry.second.attempts};
    }
    void end_lease(Item& item);
    Items::iterator reopen(Items::iterator entry);
    Items::iterator erase(Items::iterator entry);

    AuditParams params_;
    bool stopped_ = false;
    Items items_;
    std::map<ServerId, std::set<RoundKey>> open_;  ///< By author; no empty sets.
    std::set<RoundKey> for_client_;  ///< Disputed, or given up by others; not at the client yet.
    std::map<LeaseId, RoundKey> leases_;
    std::set<std::pair<TimeNs, LeaseId>> deadlines_;
};

}  // namespace pathscope
