#pragma once
/// An event: something that happened, when, and in which process. Events are what panels, plots, checks,
/// traces and recordings are made of.
///
/// An event is of fixed size and owns no memory (texts are bounded), so that a ring of them is a known number
/// of bytes. Its time is on the client's time line; a server's times are placed there before they are
/// recorded (cluster/clock_offset.hpp). Thread safety: values.   Test: tests/probe/test_event_store.cpp

#include <cstdint>
#include <variant>

#include "pathscope/core/clock.hpp"
#include "pathscope/core/enum_names.hpp"
#include "pathscope/core/ids.hpp"
#include "pathscope/probe/bounded_text.hpp"
#include "pathscope/probe/counter.hpp"

namespace pathscope {

using ShortText = BoundedText<31>;
using LongText = BoundedText<191>;

/// Work that took a while: the event's time is its begin.
struct SpanEvent {
    ShortText name;
    TimeNs duration = 0;
    LeaseId lease;  ///< The lease it served, if any: draws an arrow from the grant.
};

/// A counter's total at that moment (event_store.hpp: sample_counters).
struct CounterEvent {
    Counter counter = Counter::rounds;
    std::uint64_t total = 0;
};

enum class MessageWay { received, sent, dropped };

/// A message on a socket, as the client saw it.
struct MessageEvent {
    MessageWay way = MessageWay::received;
    ShortText type;           ///< "TILE"
    ShortText socket;         ///< "frames"
    ServerId peer;            ///< The other end; 0 = everyone, or nobody that is known.
    std::uint64_t bytes = 0;  ///< Head, header and payload.
    LongText detail;          ///< The header, readable; for a dropped one, why.
};

/// A state machine's step, with its reason.
struct StateEvent {
    ShortText machine;  ///< "peer"
    ServerId subject;   ///< Whose state it is.
    ShortText from, to;
    LongText reason;
};

/// What happened to a unit of work (with strategy `blocks`: a block), as the ledger decided.
enum class UnitChange {
    granted,    ///< A server holds the round now.
    copied,     ///< A second server holds it too.
    committed,  ///< The round is counted.
    closed,     ///< A lease ended without a result; another still holds the round, or nobody needs it.
    reopened,   ///< The last lease ended without a result: the round is the next to be given out.
    refused,    ///< A result was dropped.
};

/// Why it happened.
enum class UnitReason {
    fresh,          ///< granted: for the first time.
    retried,        ///< granted: again, to the server that had it.
    reallocated,    ///< granted: again, to another server.
    straggler,      ///< copied: its holder is late.
    result,         ///< committed: the lease's result came in time.
    late_result,    ///< committed: it came after its lease had ended, and nobody was quicker.
    lease_expired,  ///< closed, reopened: the deadline passed.
    server_lost,    ///< closed, reopened: its server died, left, or is stuck.
    released,       ///< closed, reopened: the server gave it back, or its result could not be used.
    superseded,     ///< closed: another server's result was first.
    new_epoch,      ///< closed: the pixels mean something else now.
    duplicate,      ///< refused: the round was committed already.
    stale_epoch,    ///< refused: of an old epoch.
    unknown_lease,  ///< refused: no such lease.
    mismatched,     ///< refused: not what the lease says.
    undone,         ///< reopened: the unit holds light of a server that gave false results.
};

struct UnitEvent {
    Epoch epoch;
    std::uint32_t unit = 0;
    std::uint32_t first = 0;  ///< The samples [first, first+count) of the unit.
    std::uint32_t count = 0;
    LeaseId lease;
    ServerId server;    ///< Who holds it, or whose result it is.
    ServerId previous;  ///< granted again: who held it last.
    UnitChange change = UnitChange::granted;
    UnitReason reason = UnitReason::fresh;
};

enum class CheckOutcome { unknown, no, yes };

/// A lesson's check was evaluated, or an invariant audited.
struct CheckEvent {
    LongText expression;
    CheckOutcome outcome = CheckOutcome::unknown;
};

/// A command that was carried out: the only way to act.
struct CommandEvent {
    LongText text;
    ShortText origin;  ///< "menu", "lesson", "script"
};

struct NoteEvent {
    LongText text;
};

using EventBody = std::variant<SpanEvent, CounterEvent, MessageEvent, StateEvent, UnitEvent, CheckEvent,
                               CommandEvent, NoteEvent>;

struct Event {
    TimeNs time = 0;
    std::uint64_t sequence = 0;  ///< Given by the store: 1, 2, 3...; never reused.
    ServerId process;            ///< Where it happened: 0 = the client.
    std::uint32_t track = 0;     ///< A line of its own within the process, such as a thread.
    EventBody body;
};

inline constexpr std::array k_message_way_names{
    EnumName{MessageWay::received, "received"},
    EnumName{MessageWay::sent, "sent"},
    EnumName{MessageWay::dropped, "dropped"},
};
constexpr const auto& enum_table(MessageWay) { return k_message_way_names; }

inline constexpr std::array k_unit_change_names{
    EnumName{UnitChange::granted, "granted"},     EnumName{UnitChange::copied, "copied"},
    EnumName{UnitChange::committed, "committed"}, EnumName{UnitChange::closed, "closed"},
    EnumName{UnitChange::reopened, "reopened"},   EnumName{UnitChange::refused, "refused"},
};
constexpr const auto& enum_table(UnitChange) { return k_unit_change_names; }

inline constexpr std::array k_unit_reason_names{
    EnumName{UnitReason::fresh, "fresh"},
    EnumName{UnitReason::retried, "retried"},
    EnumName{UnitReason::reallocated, "reallocated"},
    EnumName{UnitReason::straggler, "straggler"},
    EnumName{UnitReason::result, "result"},
    EnumName{UnitReason::late_result, "late_result"},
    EnumName{UnitReason::lease_expired, "lease_expired"},
    EnumName{UnitReason::server_lost, "server_lost"},
    EnumName{UnitReason::released, "released"},
    EnumName{UnitReason::superseded, "superseded"},
    EnumName{UnitReason::new_epoch, "new_epoch"},
    EnumName{UnitReason::duplicate, "duplicate"},
    EnumName{UnitReason::stale_epoch, "stale_epoch"},
    EnumName{UnitReason::unknown_lease, "unknown_lease"},
    EnumName{UnitReason::mismatched, "mismatched"},
    EnumName{UnitReason::undone, "undone"},
};
constexpr const auto& enum_table(UnitReason) { return k_unit_reason_names; }

inline constexpr std::array k_check_outcome_names{
    EnumName{CheckOutcome::unknown, "unknown"},
    EnumName{CheckOutcome::no, "no"},
    EnumName{CheckOutcome::yes, "yes"},
};
constexpr const auto& enum_table(CheckOutcome) { return k_check_outcome_names; }

}  // namespace pathscope
