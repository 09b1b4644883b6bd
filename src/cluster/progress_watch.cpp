#include "pathscope/cluster/progress_watch.hpp"

#include <algorithm>

namespace pathscope {

void ProgressWatch::on_heartbeat(std::uint64_t counter, std::uint32_t leases, TimeNs now) {
    if (counter > counter_ || leases == 0) {
        counter_ = std::max(counter_, counter);
        still_ = 0;
        beats_ = 0;
    } else {
        still_ += std::min(now - last_beat_, 2 * heartbeat_);
        ++beats_;
    }
    last_beat_ = now;
}

bool ProgressWatch::stuck(TimeNs turnaround) const {
    return beats_ >= k_least_beats && still_ >= std::max(k_least_patience, k_turnarounds * turnaround);
}

}  // namespace pathscope
