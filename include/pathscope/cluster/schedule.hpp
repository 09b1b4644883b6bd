#pragma once
/// Schedules: which open round a server gets next.
///
///   static    unit i belongs to server i mod N; when a server dies its units are dealt out to the others
///             (the classic system's fixed strips, made finer)
///   weighted  units are dealt in proportion to measured speed
///   pull      any open round to whoever asks; the default: fast servers ask more often, so that it
///             balances itself
///
/// All give out reopened rounds first (someone waited for them long enough), then fresh ones pass by pass in
/// unit order: every unit gets its first round before any gets its second, so that the picture grows evenly.
///
/// A schedule only proposes; the ledger grants, and refuses what is not open. So no schedule can lose or
/// double a round. No clock, no socket. Cost: pick is O(1) amortised over a plan, plus a search of the
/// reopened rounds (never more than leases were outstanding) for `static` and `weighted`.
/// Thread safety: one thread at a time.   Test: tests/cluster/test_schedule.cpp

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "pathscope/cluster/ledger.hpp"
#include "pathscope/core/enum_names.hpp"
#include "pathscope/core/ids.hpp"

namespace pathscope {

enum class ScheduleKind { static_shares, weighted_shares, pull };

inline constexpr std::array k_schedule_names{
    EnumName{ScheduleKind::static_shares, "static"},
    EnumName{ScheduleKind::weighted_shares, "weighted"},
    EnumName{ScheduleKind::pull, "pull"},
};
constexpr const auto& enum_table(ScheduleKind) { return k_schedule_names; }

enum class UnitOrder {
    scanline,  ///< Row by row.
    spiral,    ///< Centre out: where people look comes first.
};

inline constexpr std::array k_unit_order_names{
    EnumName{UnitOrder::scanline, "scanline"},
    EnumName{UnitOrder::spiral, "spiral"},
};
constexpr const auto& enum_table(UnitOrder) { return k_unit_order_names; }

/// The units of a grid, numbered row by row, in the order they are to be begun: each once.
[[nodiscard]] std::vector<std::uint32_t> make_unit_order(UnitOrder order, std::uint32_t columns,
                                                         std::uint32_t rows);

/// A server that may be given work.
struct ServerShare {
    ServerId id;
    double speed = 0;  ///< Samples per second, any unit that is the same for all; 0 = not measured yet.
};

class Schedule {
  public:
    /// Requires: unit_order names each unit of the plans to come once.
    Schedule(ScheduleKind kind, std::vector<std::uint32_t> unit_order);

    [[nodiscard]] ScheduleKind kind() const { return kind_; }

    /// Tells who may be given work; call it when someone joins, leaves or got faster. `static` deals anew
    /// when someone joins, and moves only the units of those who left; `weighted` deals anew when someone
    /// joins or leaves, or a speed moved by more than a quarter; `pull` needs no dealing.
    void set_servers(std::vector<ServerShare> alive);

    /// A round that ledger.grant(server, round, ...) will grant, or nothing if there is none for this server.
    /// A server that set_servers did not name gets none. Requires: ledger.plan().units == size of unit_order.
    [[nodiscard]] std::optional<RoundKey> pick(const Ledger& ledger, ServerId server);

    /// The owner of each unit, by unit number; empty for `pull`, and while there is no server.
    [[nodiscard]] const std::vector<ServerId>& owners() const { return owner_of_unit_; }

  private:
    /// Walks a share's fresh rounds: pass after pass, in unit order.
    struct Walk {
        std::vector<std::uint32_t> units;
        std::size_t position = 0;
        std::uint32_t pass = 0;
        bool begun = false;
        bool done = false;
    };

    [[nodiscard]] static std::optional<RoundKey> next_of(Walk& walk, const Ledger& ledger);
    [[nodiscard]] bool owns(ServerId server, std::uint32_t unit) const;
    void deal_static();
    void deal_weighted();
    void make_walks();

    static constexpr ServerId k_everyone{~0u};  ///< Whose walk it is with `pull`.

    ScheduleKind kind_;
    std::vector<std::uint32_t> unit_order_;
    std::vector<ServerShare> alive_;  ///< By rising id.
    std::vector<ServerShare> dealt_;  ///< To whom the units were dealt last.
    std::vector<ServerId> owner_of_unit_;
    std::map<ServerId, Walk> walks_;  ///< By owner.
    Epoch epoch_;
    std::uint64_t rounds_open_ = 0;  ///< When the walks were begun.
};

/// The straggler's lease that a server with nothing else to do had better compute too: the oldest that
/// only one other server holds, if it has run longer than k_straggler_factor times what this server would
/// need for it. Spark speculates at 1.5 times the median; the same factor here.
/// own_estimate(lease): that time; nothing if it is not known.
inline constexpr double k_straggler_factor = 1.5;
[[nodiscard]] std::optional<Lease> pick_straggler(
    const Ledger& ledger, ServerId server, TimeNs now,
    const std::function<std::optional<TimeNs>(const Lease&)>& own_estimate);

}  // namespace pathscope
