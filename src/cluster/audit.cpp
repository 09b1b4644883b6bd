#include "pathscope/cluster/audit.hpp"

#include <cmath>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

/// SplitMix64's finaliser: every bit of the input moves every bit of the output.
std::uint64_t mix(std::uint64_t z) {
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

}  // namespace

void Audit::begin() {
    items_.clear();
    open_.clear();
    for_client_.clear();
    leases_.clear();
    deadlines_.clear();
    stopped_ = false;
}

bool Audit::chosen(RoundKey round) const {
    if (params_.share >= 1) return true;
    const std::uint64_t number = std::uint64_t{round.unit} << 32 | round.index;
    return std::ldexp(double(mix(mix(number + 0x9e3779b97f4a7c15u) ^ params_.secret)), -64) < params_.share;
}

bool Audit::on_merged(const AuditedRound& merged) {
    if (stopped_ || merged.author == k_local_server || !chosen(merged.round)) return false;
    const bool is_new =
        items_.emplace(merged.round, Item{merged.samples, merged.author, merged.result, {}}).second;
    CHECK(is_new, merged.round.unit, merged.round.index);
    open_[merged.author].insert(merged.round);
    return true;
}

// ---- The second opinion of a server.

std::optional<AuditedRound> Audit::next_for(ServerId server,
                                            const std::function<bool(ServerId)>& may_judge) const {
    for (const auto& [author, rounds] : open_)
        if (author != server && (!may_judge || may_judge(author)))
            return round_of(*items_.find(*rounds.begin()));
    return std::nullopt;
}

void Audit::grant(const AuditedRound& granted, const Lease& lease) {
    Item& item = items_.at(granted.round);
    CHECK(item.open() && item.author != lease.server, item.author, lease.server);
    const auto open = open_.find(item.author);
    open->second.erase(granted.round);
    if (open->second.empty()) open_.erase(open);
    item.lease = lease;
    ++item.attempts;
    leases_.emplace(lease.id, granted.round);
    deadlines_.emplace(lease.deadline, lease.id);
}

bool Audit::holds(const ResultClaim& claim) const {
    const auto found = leases_.find(claim.lease);
    if (found == leases_.end()) return false;
    const Lease& lease = *items_.at(found->second).lease;
    return claim == ResultClaim{lease.id, lease.epoch, lease.unit, lease.first, lease.count, lease.server};
}

bool Audit::on_opinion(const ResultClaim& claim, const Digest& result) {
    CHECK(holds(claim));
    const auto entry = items_.find(leases_.at(claim.lease));
    Item& item = entry->second;
    end_lease(item);
    if (item.result == result) {
        items_.erase(entry);
        return true;
    }
    item.opinion.emplace(claim.server, result);
    for_client_.insert(entry->first);
    return false;
}

void Audit::end_lease(Item& item) {
    leases_.erase(item.lease->id);
    deadlines_.erase({item.lease->deadline, item.lease->id});
    item.lease.reset();
}

Audit::Items::iterator Audit::reopen(Items::iterator entry) {
    Item& item = entry->second;
    if (item.lease) end_lease(item);
    item.at_client = false;
    if (item.is_for_client())
        for_client_.insert(entry->first);
    else if (stopped_)
        return erase(entry);
    else
        open_[item.author].insert(entry->first);
    return std::next(entry);
}

bool Audit::release(LeaseId lease, ServerId server) {
    const auto found = leases_.find(lease);
    if (found == leases_.end()) return false;
    const auto entry = items_.find(found->second);
    if (entry->second.lease->server != server) return false;
    reopen(entry);
    return true;
}

void Audit::revoke(ServerId server) {
    for (auto it = items_.begin(); it != items_.end();)
        it = it->second.lease && it->second.lease->server == server ? reopen(it) : std::next(it);
}

void Audit::expire(TimeNs now) {
    while (!deadlines_.empty() && deadlines_.begin()->first <= now)
        reopen(items_.find(leases_.at(deadlines_.begin()->second)));
}

std::optional<TimeNs> Audit::next_deadline() const {
    if (deadlines_.empty()) return std::nullopt;
    return deadlines_.begin()->first;
}

// ---- The client's own.

std::optional<AuditedRound> Audit::next_for_client(const std::function<bool(ServerId)>& nobody_else) const {
    if (!for_client_.empty()) return round_of(*items_.find(*for_client_.begin()));
    for (const auto& [author, rounds] : open_)
        if (nobody_else(author)) return round_of(*items_.find(*rounds.begin()));
    return std::nullopt;
}

void Audit::grant_to_client(RoundKey round) {
    Item& item = items_.at(round);
    CHECK(!item.lease && !item.at_client);
    item.at_client = true;
    if (for_client_.erase(round) > 0) return;
    const auto open = open_.find(item.author);
    open->second.erase(round);
    if (open->second.empty()) open_.erase(open);
}

void Audit::release_client(RoundKey round) {
    if (const auto entry = items_.find(round); entry != items_.end() && entry->second.at_client)
        reopen(entry);
}

std::vector<ServerId> Audit::on_truth(RoundKey round, const Digest& result) {
    std::vector<ServerId> liars;
    const auto entry = items_.find(round);
    if (entry == items_.end() || !entry->second.at_client) return liars;
    const Item& item = entry->second;
    if (item.result != result) liars.push_back(item.author);
    if (item.opinion && item.opinion->second != result) liars.push_back(item.opinion->first);
    items_.erase(entry);
    return liars;
}

// ---- Giving up.

Audit::Items::iterator Audit::erase(Items::iterator entry) {
    if (entry->second.lease) end_lease(entry->second);
    for_client_.erase(entry->first);
    if (const auto open = open_.find(entry->second.author); open != open_.end()) {
        open->second.erase(entry->first);
        if (open->second.empty()) open_.erase(open);
    }
    return items_.erase(entry);
}

std::vector<Lease> Audit::forget(std::uint32_t unit) {
    std::vector<Lease> cancelled;
    for (auto it = items_.lower_bound({unit, 0}); it != items_.end() && it->first.unit == unit;) {
        if (it->second.lease) cancelled.push_back(*it->second.lease);
        it = erase(it);
    }
    return cancelled;
}

void Audit::stop() {
    if (std::exchange(stopped_, true)) return;
    for (auto it = items_.begin(); it != items_.end();)
        it = it->second.open() && !it->second.is_for_client() ? erase(it) : std::next(it);
}

}  // namespace pathscope
