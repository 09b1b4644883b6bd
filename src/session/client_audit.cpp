/// The client's part in audits (cluster/audit.hpp): it deals them out, judges, and takes back what a liar gave.

#include <fmt/format.h>

#include <algorithm>

#include "pathscope/core/log.hpp"
#include "pathscope/protocol/block_result.hpp"
#include "pathscope/session/client_machine.hpp"

namespace pathscope {

// ---- What is to be audited, and by whom.

/// Books whose work a merged result was.
void ClientMachine::note_merged(LightPart part, const ResultClaim& claim, std::uint32_t rounds,
                                const RoundResult& result, std::span<const PixelSum> sums) {
    if (!audit_.enabled()) return;
    Contributions& gave = part == LightPart::direct ? gave_direct_ : gave_indirect_;
    gave.add(claim.unit, {claim.server, 1, rounds, result.samples, result.rays, result.dropped_count,
                          result.saturated_count});
    if (part == LightPart::direct) return;
    const RoundKey round = work_.indirect_ledger().round_at(claim.unit, claim.first);
    const auto author = authors_.find(claim.server);
    const bool may_differ = author != authors_.end() && !author->second.same_bits;  // Without a lie.
    if (may_differ || !audit_.chosen(round)) return;
    if (audit_.on_merged({round, {claim.first, claim.count}, claim.server, hash_of_sums(sums)}))
        serve_all_ = true;  // Another server than this one may have nothing to do.
}

std::uint32_t ClientMachine::rounds_of(std::uint32_t unit, SampleRange samples) const {
    return work_.indirect_ledger().rounds_in(unit, samples).value().rounds;
}

/// A round for a second opinion of this server. Not of servers of other bits, who may differ without a lie.
std::optional<AuditedRound> ClientMachine::next_audit(const Server& server) const {
    if (audit_.settled() || !server.same_bits) return std::nullopt;
    return audit_.next_for(server.peer.id(),
                           [&](ServerId author) { return authors_.at(author).who != server.who; });
}

Lease ClientMachine::grant_audit(const AuditedRound& item, ServerId server, TimeNs duration) {
    const Lease lease{work_.indirect_ledger().new_lease_id(),
                      work_.epoch(),
                      item.round.unit,
                      item.samples.first,
                      item.samples.count,
                      server,
                      now_,
                      now_ + duration,
                      false};
    audit_.grant(item, lease);
    return lease;
}

/// What the client has to render itself: a dispute, or a round whose author is the only server that can be compared with.
std::optional<AuditedRound> ClientMachine::next_local_audit(bool disputes_only) const {
    if (audit_.settled()) return std::nullopt;
    // One is enough, and of a thousand the first two tell whether there is one beside any author.
    std::vector<std::string_view> judges;
    for (auto it = servers_.begin(); it != servers_.end() && judges.size() < 2 && !disputes_only; ++it)
        if (it->second.peer.accepts_work() && it->second.same_bits &&
            (judges.empty() || judges.front() != it->second.who))
            judges.push_back(it->second.who);
    if (judges.size() > 1) disputes_only = true;
    return audit_.next_for_client([&](ServerId author) {
        return !disputes_only && (judges.empty() || judges.front() == authors_.at(author).who);
    });
}

// ---- Opinions.

void ClientMachine::on_opinion(const ResultClaim& claim, std::span<const PixelSum> sums) {
    const auto author = audit_.author_of(claim.lease);
    if (audit_.on_opinion(claim, hash_of_sums(sums)))
        return store_.count(Counter::rounds_audited, rounds_of(claim.unit, {claim.first, claim.count}),
                            author);
    record(NoteEvent{LongText(fmt::format(
        "Servers {} and {} differ about samples {} to {} of unit {}; the client judges.", author.value,
        claim.server.value, claim.first, claim.first + claim.count - 1, claim.unit))});
}

/// The client's own light has lost no bits. What servers send may have, by rounding that is the same for all.
Digest ClientMachine::hash_as_sent(std::vector<PixelSum> sums, std::uint32_t samples) const {
    const WireFormat wire = job_.state.settings.wire;
    if (wire != WireFormat::exact) {
        const auto rounded = read_rounded_sums(wire, round_sums(wire, sums), samples, sums);
        CHECK(bool(rounded), rounded.error().message);
    }
    return hash_of_sums(sums);
}

void ClientMachine::on_own_opinion(const LocalWork& work, const RoundOutcome& outcome) {
    const AuditedRound& item = *work.audit;
    if (work.epoch != work_.epoch()) return;
    if (!outcome.result) return audit_.release_client(item.round);
    const std::size_t unsettled = audit_.unsettled();
    const auto liars = audit_.on_truth(item.round, hash_as_sent(outcome.result->sums, item.samples.count));
    if (audit_.unsettled() < unsettled)  // It may be that it was undone meanwhile.
        store_.count(Counter::rounds_audited, rounds_of(item.round.unit, item.samples), item.author);
    std::vector<Author> convicted;  // Their names are forgotten with the epoch that the first one ends.
    for (const ServerId liar : liars) {
        store_.count(Counter::audits_differing, 1, liar);
        convicted.push_back(authors_.at(liar));
    }
    for (const Author& liar : convicted) convict(liar, item);
}

// ---- The consequences.

/// Bans a server that gave a false result, and takes back all that it gave to this frame, under whatever number.
void ClientMachine::convict(const Author& liar, const AuditedRound& item) {
    std::vector<ServerId> numbers;
    for (const auto& [id, other] : authors_)
        if (other.who == liar.who) numbers.push_back(id);
    const auto ban = conduct_.report(liar.who, Offence::false_result, now_);
    if (ban) shut_out(liar.who, *ban);

    const std::size_t undone =
        config_.sampling.staged() ? begin_anew() : undo(gave_indirect_.units_of(numbers));
    const std::string sentence = fmt::format(
        "{} gave a false result (samples {} to {} of block {}): {} rounds that stand beside its own are "
        "rendered again.",
        liar.name, item.samples.first, item.samples.first + item.samples.count - 1,
        item.round.unit % work_.grid().count(), undone);
    record(NoteEvent{LongText(sentence)});
    log_warning(sentence);
}

std::size_t ClientMachine::undo(const std::vector<std::uint32_t>& units) {
    std::size_t undone = 0;
    for (const std::uint32_t unit : units) {
        for (const Lease& lease : audit_.forget(unit)) cancel(lease);
        take_back(gave_indirect_.take(unit), true);
        undone += work_.undo(unit, now_);
        const PixelRect rect = work_.rect_of(unit);
        std::erase_if(dropped_, [&](const DroppedSample& sample) {
            return rect.contains(int(sample.x), int(sample.y));
        });
    }
    store_.count(Counter::rounds_undone, undone);
    servers_changed();
    return undone;
}

/// The noise of false light has decided how many samples blocks get: the frame begins anew, for all.
std::size_t ClientMachine::begin_anew() {
    const Ledger& ledger = work_.indirect_ledger();
    std::uint64_t undone = 0;
    for (std::uint32_t unit = 0; unit < gave_direct_.units(); ++unit)
        take_back(gave_direct_.take(unit), false);
    for (std::uint32_t unit = 0; unit < gave_indirect_.units(); ++unit)
        undone += take_back(gave_indirect_.take(unit), true);
    store_.take_back(
        {{Counter::rounds, ledger.rounds()}, {Counter::rounds_committed, ledger.rounds_committed() - undone}},
        k_local_server);
    store_.count(Counter::rounds_undone, undone);
    dropped_.clear();
    begin_epoch(PackMap{}, true);
    return undone;
}

/// Returns how many rounds they were.
std::uint64_t ClientMachine::take_back(const std::vector<Contribution>& gave, bool indirect) {
    std::uint64_t rounds = 0;
    for (const Contribution& one : gave) {
        rounds += one.rounds;
        saturated_ -= one.saturated;
        const auto author = authors_.find(one.server);
        const bool differs = author != authors_.end() && !author->second.same_bits;
        if (differs) differing_rounds_ -= one.rounds;
        store_.take_back({{Counter::tiles, one.tiles},
                          {Counter::rounds_committed, indirect ? one.rounds : 0},
                          {Counter::rays, one.rays},
                          {Counter::samples, one.samples},
                          {Counter::nonfinite_dropped, one.nonfinite},
                          {Counter::differing_rounds, differs ? one.rounds : 0}},
                         one.server);
    }
    return rounds;
}

}  // namespace pathscope
