#pragma once
/// A server as the client sees it: a state machine that is one table, and its credits.
///
///     NEW --welcomed--> SYNCING --synced--> READY <--heard-- SUSPECT
///                          ^                 | |  --silent-->   |
///                          +---state_lost----+ +--drain--> DRAINING --left--> GONE
///     READY or SUSPECT --stuck--> STUCK --moved--> READY
///     from any of these: --lost--> DEAD --removed--> GONE
///
/// Busy or idle is not a state: a READY server is busy while the ledger says it holds a lease. One truth.
/// SUSPECT keeps its leases (a copy of its rounds may go to others); STUCK lives and loses them (progress_watch.hpp); DEAD
/// loses them too, its id is never used again, and if it speaks it has to say HELLO anew. What the table does not list is
/// refused and counted. No clock, no socket. Thread safety: one thread at a time.   Test: tests/cluster/test_peer.cpp

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "pathscope/cluster/failure_detector.hpp"
#include "pathscope/core/clock.hpp"
#include "pathscope/core/enum_names.hpp"
#include "pathscope/core/ids.hpp"

namespace pathscope {

enum class PeerState { fresh, syncing, ready, suspect, stuck, draining, dead, gone };

inline constexpr std::array k_peer_state_names{
    EnumName{PeerState::fresh, "NEW"},   EnumName{PeerState::syncing, "SYNCING"},
    EnumName{PeerState::ready, "READY"}, EnumName{PeerState::suspect, "SUSPECT"},
    EnumName{PeerState::stuck, "STUCK"}, EnumName{PeerState::draining, "DRAINING"},
    EnumName{PeerState::dead, "DEAD"},   EnumName{PeerState::gone, "GONE"},
};
constexpr const auto& enum_table(PeerState) { return k_peer_state_names; }

enum class PeerCause {
    welcomed,
    synced,
    state_lost,
    silent,
    heard,
    stuck,
    moved,
    drain,
    left,
    lost,
    removed
};

inline constexpr std::array k_peer_cause_names{
    EnumName{PeerCause::welcomed, "welcomed"},
    EnumName{PeerCause::synced, "synced"},
    EnumName{PeerCause::state_lost, "state_lost"},
    EnumName{PeerCause::silent, "silent"},
    EnumName{PeerCause::heard, "heard"},
    EnumName{PeerCause::stuck, "stuck"},
    EnumName{PeerCause::moved, "moved"},
    EnumName{PeerCause::drain, "drain"},
    EnumName{PeerCause::left, "left"},
    EnumName{PeerCause::lost, "lost"},
    EnumName{PeerCause::removed, "removed"},
};
constexpr const auto& enum_table(PeerCause) { return k_peer_cause_names; }

struct PeerTransition {
    PeerState from;
    PeerCause cause;
    PeerState to;
    std::string_view reason;  ///< For people.
};

/// The row for this state and cause, or null: the step is illegal.
[[nodiscard]] const PeerTransition* find_transition(PeerState from, PeerCause cause);

/// All rows: for documents, panels and the test that walks them.
[[nodiscard]] const std::vector<PeerTransition>& peer_transitions();

class Peer {
  public:
    Peer(ServerId id, TimeNs now) : id_(id), since_(now) {}

    /// Takes the step if the table has it; returns the row, or null and counts a refusal.
    const PeerTransition* apply(PeerCause cause, TimeNs now);

    /// Takes the step that a detector's opinion asks for, if any: lost, silent or heard. Only a READY server
    /// becomes SUSPECT, for suspicion is about leases, and the others hold none that could be copied.
    const PeerTransition* apply(Liveness liveness, TimeNs now);

    [[nodiscard]] ServerId id() const { return id_; }
    [[nodiscard]] PeerState state() const { return state_; }
    [[nodiscard]] TimeNs since() const { return since_; }
    [[nodiscard]] std::uint64_t refused() const { return refused_; }

    /// May be given work; a suspect keeps what it has but gets no more.
    [[nodiscard]] bool accepts_work() const { return state_ == PeerState::ready; }
    /// Its results still count: it was never given up.
    [[nodiscard]] bool alive() const { return state_ != PeerState::dead && state_ != PeerState::gone; }

  private:
    ServerId id_;
    PeerState state_ = PeerState::fresh;
    TimeNs since_;
    std::uint64_t refused_ = 0;
};

/// Credits: how many leases a server may owe an answer for. Bounds what piles up at it, and in between.
///
/// A lease's credit comes back when its result is merged or refused, or when the server gives the lease back;
/// not when the lease expires, for then the server is still busy with it. A server that never answers gets it
/// back when the debt is written off, so that a lost message does not starve it for ever.
class Credits {
  public:
    explicit Credits(std::size_t limit = 2) : limit_(limit) {}

    void set_limit(std::size_t limit) { limit_ = limit; }
    [[nodiscard]] std::size_t limit() const { return limit_; }
    [[nodiscard]] std::size_t owed() const { return debts_.size(); }
    [[nodiscard]] bool available() const { return debts_.size() < limit_; }

    /// Requires: available().
    void take(LeaseId lease, TimeNs now, TimeNs written_off_at);

    /// The server answered for this lease. False if it owed nothing for it.
    bool settle(LeaseId lease);

    /// The server says that it owes nothing, and that `received` is the largest lease that reached it. So what is owed up to
    /// that one was answered, and the answer was lost; of the others, those taken before `sent_before` were lost on their
    /// way. Settles both, and returns them.
    std::vector<LeaseId> settle_lost(LeaseId received, TimeNs sent_before);

    /// Forgets debts due at or before now; returns how many.
    std::size_t write_off(TimeNs now);

    /// A new epoch or a new connection: nothing is owed.
    void clear() { debts_.clear(); }

  private:
    struct Debt {
        LeaseId lease;
        TimeNs taken;
        TimeNs written_off_at;
    };
    std::size_t limit_;
    std::vector<Debt> debts_;
};

}  // namespace pathscope
