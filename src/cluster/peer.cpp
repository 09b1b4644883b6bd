#include "pathscope/cluster/peer.hpp"

#include <algorithm>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

using S = PeerState;
using C = PeerCause;

const std::vector<PeerTransition> k_transitions{
    {S::fresh, C::welcomed, S::syncing, "its HELLO was good, and the complete state is on its way"},
    {S::syncing, C::welcomed, S::syncing, "it said HELLO again: the WELCOME was late or lost"},
    {S::syncing, C::state_lost, S::syncing, "it asked for the complete state again"},
    {S::syncing, C::synced, S::ready, "it has the scene and the state of this epoch"},
    {S::ready, C::state_lost, S::syncing, "it missed an input message, and asked for the complete state"},
    {S::suspect, C::state_lost, S::syncing, "it missed an input message, and asked for the complete state"},
    {S::ready, C::silent, S::suspect, "it has been silent for unusually long"},
    {S::suspect, C::heard, S::ready, "it was heard again"},
    {S::ready, C::stuck, S::stuck, "it answers, but its work has stood still for too long"},
    {S::suspect, C::stuck, S::stuck, "it answers, but its work has stood still for too long"},
    {S::stuck, C::moved, S::ready, "its work goes on"},
    {S::stuck, C::state_lost, S::syncing, "it missed an input message, and asked for the complete state"},

    {S::syncing, C::drain, S::draining, "it finishes what it has and leaves"},
    {S::ready, C::drain, S::draining, "it finishes what it has and leaves"},
    {S::suspect, C::drain, S::draining, "it finishes what it has and leaves"},
    {S::stuck, C::drain, S::draining, "it finishes what it has and leaves"},

    {S::fresh, C::left, S::gone, "it said good-bye"},
    {S::syncing, C::left, S::gone, "it said good-bye"},
    {S::ready, C::left, S::gone, "it said good-bye"},
    {S::suspect, C::left, S::gone, "it said good-bye"},
    {S::stuck, C::left, S::gone, "it said good-bye"},
    {S::draining, C::left, S::gone, "it said good-bye"},

    {S::fresh, C::lost, S::dead, "its connection broke, or it has been silent for too long"},
    {S::syncing, C::lost, S::dead, "its connection broke, or it has been silent for too long"},
    {S::ready, C::lost, S::dead, "its connection broke, or it has been silent for too long"},
    {S::suspect, C::lost, S::dead, "its connection broke, or it has been silent for too long"},
    {S::stuck, C::lost, S::dead, "its connection broke, or it has been silent for too long"},
    {S::draining, C::lost, S::dead, "its connection broke, or it has been silent for too long"},

    {S::dead, C::removed, S::gone, "its leases were given to others"},
};

}  // namespace

const std::vector<PeerTransition>& peer_transitions() { return k_transitions; }

const PeerTransition* find_transition(PeerState from, PeerCause cause) {
    const auto row = std::find_if(
        k_transitions.begin(), k_transitions.end(),
        [&](const PeerTransition& candidate) { return candidate.from == from && candidate.cause == cause; });
    return row == k_transitions.end() ? nullptr : &*row;
}

const PeerTransition* Peer::apply(PeerCause cause, TimeNs now) {
    const PeerTransition* const row = find_transition(state_, cause);
    if (row == nullptr) {
        ++refused_;
        return nullptr;
    }
    if (row->to != state_) since_ = now;
    state_ = row->to;
    return row;
}

const PeerTransition* Peer::apply(Liveness liveness, TimeNs now) {
    if (liveness == Liveness::dead && alive()) return apply(PeerCause::lost, now);
    if (liveness == Liveness::suspect && state_ == PeerState::ready) return apply(PeerCause::silent, now);
    if (liveness == Liveness::alive && state_ == PeerState::suspect) return apply(PeerCause::heard, now);
    return nullptr;
}

void Credits::take(LeaseId lease, TimeNs now, TimeNs written_off_at) {
    CHECK(available(), debts_.size(), limit_);
    debts_.push_back({lease, now, written_off_at});
}

std::vector<LeaseId> Credits::settle_lost(LeaseId received, TimeNs sent_before) {
    std::vector<LeaseId> lost;
    for (const Debt& debt : debts_)
        if (debt.lease <= received || debt.taken < sent_before) lost.push_back(debt.lease);
    for (const LeaseId lease : lost) settle(lease);
    return lost;
}

bool Credits::settle(LeaseId lease) {
    return std::erase_if(debts_, [&](const Debt& debt) { return debt.lease == lease; }) > 0;
}

std::size_t Credits::write_off(TimeNs now) {
    return std::erase_if(debts_, [&](const Debt& debt) { return debt.written_off_at <= now; });
}

}  // namespace pathscope
