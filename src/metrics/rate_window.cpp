#include "pathscope/metrics/rate_window.hpp"

namespace pathscope {

void RateWindow::add(const CounterTotals& totals, TimeNs now) {
    if (!moments_.empty() && now - moments_.back().time < k_spacing) return;
    moments_.push_back({now, totals});
    while (now - moments_.front().time > k_window) moments_.pop_front();
}

CounterRates RateWindow::rates() const {
    if (moments_.size() < 2) return {};
    const Moment &first = moments_.front(), &last = moments_.back();
    const double seconds = to_seconds(last.time - first.time);
    const auto rate = [&](Counter counter) {
        const auto i = std::size_t(counter);
        return double(last.totals[i] - first.totals[i]) / seconds;
    };
    return {rate(Counter::rays), rate(Counter::samples), rate(Counter::tiles)};
}

}  // namespace pathscope
