#include "pathscope/core/clock.hpp"

#include <chrono>

namespace pathscope {

TimeNs monotonic_now() {
    const auto since_start = std::chrono::steady_clock::now().time_since_epoch();
    return std::chrono::duration_cast<std::chrono::nanoseconds>(since_start).count();
}

}  // namespace pathscope
