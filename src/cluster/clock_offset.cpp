#include "pathscope/cluster/clock_offset.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>

namespace pathscope {

std::optional<TimeNs> ClockEstimate::add(const ClockExchange& exchange) {
    const auto& [sent, received, answered, returned] = exchange;
    if (!is_plausible(sent) || !is_plausible(received) || !is_plausible(answered) || !is_plausible(returned))
        return std::nullopt;
    if (returned < sent || answered < received) return std::nullopt;
    const TimeNs rtt = (returned - sent) - (answered - received);
    if (rtt < 0) return std::nullopt;

    // Halved one by one: the two differences can each be close to the largest number.
    const TimeNs there = received - sent;
    const TimeNs back = answered - returned;
    const TimeNs offset = there / 2 + back / 2 + (there % 2 + back % 2) / 2;
    entries_[seen_++ % k_window] = {offset, rtt, returned};
    return rtt;
}

std::optional<ClockOffset> ClockEstimate::at(TimeNs now) const {
    std::optional<ClockOffset> best;
    for (std::size_t i = 0; i < std::min(seen_, k_window); ++i) {
        const Entry& entry = entries_[i];
        const double drift = k_drift * static_cast<double>(std::abs(now - entry.taken));
        // Rounded up, and one more for the halving above.
        const TimeNs error = entry.rtt / 2 + static_cast<TimeNs>(drift) + 2;
        if (!best || error < best->error) best = ClockOffset{entry.offset, error, entry.rtt};
    }
    return best;
}

}  // namespace pathscope
