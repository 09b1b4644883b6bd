#pragma once
/// Virtual time: things that happen, in the order of their moments, and of their planning where those are equal.

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>

#include "pathscope/core/clock.hpp"

namespace pathscope::testing {

class VirtualTime {
  public:
    [[nodiscard]] TimeNs now() const { return now_; }
    [[nodiscard]] bool empty() const { return happenings_.empty(); }
    [[nodiscard]] TimeNs next() const { return happenings_.begin()->first.first; }

    void at(TimeNs when, std::function<void()> happens) {
        happenings_.emplace(std::pair(std::max(when, now_), ++planned_), std::move(happens));
    }

    /// Lets the next thing happen. Requires: !empty().
    void step() {
        const auto next = happenings_.extract(happenings_.begin());
        now_ = next.key().first;
        next.mapped()();
    }

  private:
    TimeNs now_ = 0;
    std::uint64_t planned_ = 0;
    std::map<std::pair<TimeNs, std::uint64_t>, std::function<void()>> happenings_;
};

}  // namespace pathscope::testing
