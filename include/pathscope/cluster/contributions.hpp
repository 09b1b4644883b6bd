#pragma once
/// Who gave what to which unit: what has to be taken back when a server turns out to have lied.
///
///     sums are added up, and cannot be told apart again   =>   a unit is undone whole, with what honest servers gave to it
///
/// Why not one sum for each server and pixel: it would be the frame times the servers in memory, for an event that hardly
/// ever happens. With few rounds for each unit, most units hold nothing of the liar and stay.
/// Memory: 56 bytes for each pair of a unit and a server that gave to it.
/// Thread safety: one thread at a time.   Test: tests/cluster/test_audit.cpp

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "pathscope/core/ids.hpp"

namespace pathscope {

struct Contribution {
    ServerId server;
    std::uint64_t tiles = 0, rounds = 0, samples = 0, rays = 0, nonfinite = 0, saturated = 0;

    Contribution& operator+=(const Contribution& other) {
        tiles += other.tiles;
        rounds += other.rounds;
        samples += other.samples;
        rays += other.rays;
        nonfinite += other.nonfinite;
        saturated += other.saturated;
        return *this;
    }
};

class Contributions {
  public:
    void clear() { units_.clear(); }

    void add(std::uint32_t unit, const Contribution& more) {
        if (unit >= units_.size()) units_.resize(unit + 1);
        auto& of_unit = units_[unit];
        const auto same = std::find_if(of_unit.begin(), of_unit.end(),
                                       [&](const Contribution& one) { return one.server == more.server; });
        same == of_unit.end() ? void(of_unit.push_back(more)) : void(*same += more);
    }

    /// Units that hold something of any of these.
    [[nodiscard]] std::vector<std::uint32_t> units_of(std::span<const ServerId> servers) const {
        const auto is_one = [&](const Contribution& one) {
            return std::find(servers.begin(), servers.end(), one.server) != servers.end();
        };
        std::vector<std::uint32_t> units;
        for (std::uint32_t unit = 0; unit < units_.size(); ++unit)
            if (std::any_of(units_[unit].begin(), units_[unit].end(), is_one)) units.push_back(unit);
        return units;
    }

    /// What was given to the unit, which holds nothing from here on.
    std::vector<Contribution> take(std::uint32_t unit) {
        return unit < units_.size() ? std::exchange(units_[unit], {}) : std::vector<Contribution>{};
    }
    [[nodiscard]] std::uint32_t units() const { return std::uint32_t(units_.size()); }

  private:
    std::vector<std::vector<Contribution>> units_;
};

}  // namespace pathscope
