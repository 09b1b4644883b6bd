#include "pathscope/cluster/schedule.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <queue>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

/// A re-deal moves units from owner to owner; it must be worth it.
constexpr double k_share_moved = 0.25;

/// Where a cell lies on the spiral from the centre: its ring, then the way along the ring, clockwise from
/// the upper left corner. In half cells, so that an even grid has a centre too.
struct SpiralPlace {
    int ring = 0;
    int along = 0;
    auto operator<=>(const SpiralPlace&) const = default;
};

SpiralPlace spiral_place(std::uint32_t column, std::uint32_t row, std::uint32_t columns, std::uint32_t rows) {
    const int x = 2 * static_cast<int>(column) - static_cast<int>(columns) + 1;
    const int y = 2 * static_cast<int>(row) - static_cast<int>(rows) + 1;
    const int ring = std::max(std::abs(x), std::abs(y));
    if (y == -ring) return {ring, x + ring};              // top, left to right
    if (x == ring) return {ring, 2 * ring + (y + ring)};  // right side, down
    if (y == ring) return {ring, 4 * ring + (ring - x)};  // bottom, right to left
    return {ring, 6 * ring + (ring - y)};                 // left side, up
}

bool by_id(const ServerShare& a, const ServerShare& b) { return a.id < b.id; }

bool contains(const std::vector<ServerShare>& servers, ServerId id) {
    return std::binary_search(servers.begin(), servers.end(), ServerShare{id, 0}, by_id);
}

bool same_servers(const std::vector<ServerShare>& a, const std::vector<ServerShare>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const ServerShare& x, const ServerShare& y) { return x.id == y.id; });
}

/// Speeds as fractions of their sum. A server not measured yet is taken for an average one.
std::vector<double> fractions(const std::vector<ServerShare>& servers) {
    double sum = 0;
    std::size_t measured = 0;
    for (const ServerShare& server : servers) {
        sum += server.speed;
        measured += server.speed > 0 ? 1 : 0;
    }
    const double average = measured > 0 ? sum / static_cast<double>(measured) : 1;
    const double whole = sum + average * static_cast<double>(servers.size() - measured);
    std::vector<double> shares;
    for (const ServerShare& server : servers)
        shares.push_back((server.speed > 0 ? server.speed : average) / whole);
    return shares;
}

bool shares_moved(const std::vector<ServerShare>& before, const std::vector<ServerShare>& after) {
    const std::vector<double> old_shares = fractions(before);
    const std::vector<double> new_shares = fractions(after);
    for (std::size_t i = 0; i < old_shares.size(); ++i)
        if (std::abs(new_shares[i] - old_shares[i]) > k_share_moved * old_shares[i]) return true;
    return false;
}

}  // namespace

std::vector<std::uint32_t> make_unit_order(UnitOrder order, std::uint32_t columns, std::uint32_t rows) {
    CHECK(columns < 1u << 16 && rows < 1u << 16, columns, rows);
    std::vector<std::uint32_t> units(std::size_t{columns} * rows);
    for (std::uint32_t unit = 0; unit < units.size(); ++unit) units[unit] = unit;
    if (order == UnitOrder::spiral)
        std::sort(units.begin(), units.end(), [&](std::uint32_t a, std::uint32_t b) {
            return spiral_place(a % columns, a / columns, columns, rows) <
                   spiral_place(b % columns, b / columns, columns, rows);
        });
    return units;
}

Schedule::Schedule(ScheduleKind kind, std::vector<std::uint32_t> unit_order)
    : kind_(kind), unit_order_(std::move(unit_order)) {
    std::vector<bool> seen(unit_order_.size(), false);
    for (const std::uint32_t unit : unit_order_) {
        CHECK(unit < seen.size() && !seen[unit], unit, seen.size());
        seen[unit] = true;
    }
    make_walks();
}

// -- Dealing ------------------------------------------------------------------------------------------------

void Schedule::set_servers(std::vector<ServerShare> alive) {
    std::sort(alive.begin(), alive.end(), by_id);
    const bool same = same_servers(alive, alive_);
    alive_ = std::move(alive);
    if (kind_ == ScheduleKind::static_shares && !same) deal_static();
    if (kind_ == ScheduleKind::weighted_shares && (!same || shares_moved(dealt_, alive_))) deal_weighted();
}

// Unit i to server i mod N of those it was dealt to; the k-th unit of a server that left, to the k-th of the
// others. So a death moves only the units of the dead.
void Schedule::deal_static() {
    const bool joined = std::any_of(alive_.begin(), alive_.end(),
                                    [&](const ServerShare& server) { return !contains(dealt_, server.id); });
    if (joined || alive_.empty()) dealt_ = alive_;
    owner_of_unit_.assign(alive_.empty() ? 0 : unit_order_.size(), {});
    for (std::uint32_t unit = 0; unit < owner_of_unit_.size(); ++unit) {
        const ServerId dealt_to = dealt_[unit % dealt_.size()].id;
        const std::size_t turn = unit / dealt_.size();
        owner_of_unit_[unit] = contains(alive_, dealt_to) ? dealt_to : alive_[turn % alive_.size()].id;
    }
    make_walks();
}

// Each unit goes to the server that would be the first to be through with its units, this one included.
void Schedule::deal_weighted() {
    dealt_ = alive_;
    owner_of_unit_.assign(alive_.empty() ? 0 : unit_order_.size(), {});
    const std::vector<double> shares = alive_.empty() ? std::vector<double>{} : fractions(alive_);
    using Turn = std::pair<double, std::size_t>;  // when it is through, who
    std::priority_queue<Turn, std::vector<Turn>, std::greater<>> turns;
    for (std::size_t i = 0; i < shares.size(); ++i) turns.emplace(1 / shares[i], i);
    for (const std::uint32_t unit : unit_order_) {
        if (turns.empty()) break;
        const auto [through, server] = turns.top();
        turns.pop();
        owner_of_unit_[unit] = alive_[server].id;
        turns.emplace(through + 1 / shares[server], server);
    }
    make_walks();
}

void Schedule::make_walks() {
    walks_.clear();
    if (kind_ == ScheduleKind::pull) {
        walks_[k_everyone].units = unit_order_;
        return;
    }
    if (owner_of_unit_.empty()) return;
    for (const std::uint32_t unit : unit_order_) walks_[owner_of_unit_[unit]].units.push_back(unit);
}

// -- Picking ------------------------------------------------------------------------------------------------

std::optional<RoundKey> Schedule::pick(const Ledger& ledger, ServerId server) {
    CHECK(ledger.plan().units == unit_order_.size(), ledger.plan().units, unit_order_.size());
    if (ledger.stopped() || !contains(alive_, server)) return std::nullopt;
    if (ledger.plan().epoch != epoch_ || ledger.rounds_open() != rounds_open_) {
        epoch_ = ledger.plan().epoch;
        rounds_open_ = ledger.rounds_open();
        make_walks();
    }
    for (const RoundKey& round : ledger.reopened())
        if (owns(server, round.unit)) return round;
    const auto walk = walks_.find(kind_ == ScheduleKind::pull ? k_everyone : server);
    if (walk == walks_.end()) return std::nullopt;
    return next_of(walk->second, ledger);
}

bool Schedule::owns(ServerId server, std::uint32_t unit) const {
    return kind_ == ScheduleKind::pull || owner_of_unit_[unit] == server;
}

// A fresh round, once granted, is never fresh again: so the walk need not look back, and all steps of all
// picks together are at most one per round, plus one look at each unit per pass.
std::optional<RoundKey> Schedule::next_of(Walk& walk, const Ledger& ledger) {
    for (; !walk.done; walk.position = 0) {
        for (; walk.begun && walk.position < walk.units.size(); ++walk.position) {
            const std::optional<RoundKey> next = ledger.next_fresh(walk.units[walk.position]);
            if (next && next->index <= walk.pass) return next;
        }
        // The next pass is the lowest round that any unit still needs.
        std::optional<std::uint32_t> lowest;
        for (const std::uint32_t unit : walk.units)
            if (const std::optional<RoundKey> next = ledger.next_fresh(unit))
                lowest = std::min(lowest.value_or(next->index), next->index);
        walk.begun = true;
        walk.done = !lowest;
        walk.pass = lowest.value_or(0);
    }
    return std::nullopt;
}

std::optional<Lease> pick_straggler(const Ledger& ledger, ServerId server, TimeNs now,
                                    const std::function<std::optional<TimeNs>(const Lease&)>& own_estimate) {
    const std::optional<Lease> oldest = ledger.oldest_uncopied(server);
    if (!oldest || ledger.stopped()) return std::nullopt;
    const std::optional<TimeNs> own = own_estimate(*oldest);
    const double age = static_cast<double>(now - oldest->granted);
    if (!own || age <= k_straggler_factor * static_cast<double>(*own)) return std::nullopt;
    return oldest;
}

}  // namespace pathscope
