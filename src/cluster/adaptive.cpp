#include "pathscope/cluster/adaptive.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

constexpr std::uint32_t k_scout_divisor = 4;  ///< q = sqrt(picture) / 4.
constexpr std::uint32_t k_floor_divisor = 2;  ///< Half of the mean goes to every block.
constexpr std::uint64_t k_channels = 3;

/// The largest q with (4 q)^2 <= picture, and at least 1: in integers, so that every machine agrees.
std::uint32_t scout_of(std::uint32_t picture) {
    std::uint64_t q = 1;
    while ((q + 1) * (q + 1) * k_scout_divisor * k_scout_divisor <= picture) ++q;
    return std::uint32_t(q);
}

PassGoal goal_of(std::uint32_t picture, bool last) { return {picture, scout_of(picture), last}; }

/// The most picture that a budget pays for, scout included.
std::uint32_t picture_of(std::uint32_t budget) {
    std::uint32_t picture = budget - 2 * scout_of(budget);  // Not too much: the scout of a part is no larger.
    while (goal_of(picture + 1, true).samples() <= budget) ++picture;
    return picture;
}

/// What one more round takes off v / n, per pixel and sample, but for a factor that all blocks share:
/// 1 / n - 1 / (n + 1) = 1 / (n (n + 1)), n in rounds.
double gain_of_round(const BlockNoise& block, std::uint32_t rounds) {
    return block.variance / (double(block.pixels) * double(rounds) * (double(rounds) + 1));
}

/// A purse of samples of pixels.
class Budget {
  public:
    Budget(std::span<const std::uint32_t> rounds, std::span<const BlockNoise> noise,
           const RoundLimits& limits)
        : round_samples_(limits.round_samples) {
        for (std::size_t i = 0; i < noise.size(); ++i)
            left_ += std::int64_t(noise[i].pixels) *
                     (std::int64_t(limits.mean_samples) - std::int64_t(rounds[i]) * round_samples_);
    }
    [[nodiscard]] bool pay_round(const BlockNoise& block) {
        const std::int64_t price = std::int64_t(block.pixels) * round_samples_;
        if (price > left_) return false;
        left_ -= price;
        return true;
    }

  private:
    std::int64_t round_samples_;
    std::int64_t left_ = 0;
};

}  // namespace

std::uint32_t least_staged_budget(std::uint32_t round_samples) {
    return goal_of(round_samples, true).samples();
}

PassGoal goal_of_pass(std::uint32_t pass, std::uint32_t budget, std::uint32_t round_samples) {
    CHECK(budget >= least_staged_budget(round_samples), budget, round_samples);
    const std::uint32_t most = picture_of(budget);
    const bool last = pass >= 32 || (std::uint64_t{round_samples} << pass) >= most;
    return goal_of(last ? most : round_samples << pass, last);
}

void allocate_rounds(std::span<std::uint32_t> rounds, std::span<const BlockNoise> noise,
                     const RoundLimits& limits) {
    CHECK(rounds.size() == noise.size(), rounds.size(), noise.size());
    Budget budget(rounds, noise, limits);
    const std::uint32_t floor = std::clamp<std::uint32_t>(
        limits.mean_samples / k_floor_divisor / limits.round_samples, 1, limits.max_rounds);
    for (std::size_t i = 0; i < rounds.size(); ++i)
        while (rounds[i] < floor && budget.pay_round(noise[i])) ++rounds[i];

    // The block that gains most comes first; of equal ones, the first in the frame.
    const auto worse = [](const auto& a, const auto& b) {
        return a.first < b.first || (a.first == b.first && a.second > b.second);
    };
    using Offer = std::pair<double, std::size_t>;
    std::priority_queue<Offer, std::vector<Offer>, decltype(worse)> offers(worse);
    const auto offer = [&](std::size_t block) {
        const double gain = rounds[block] > 0 && rounds[block] < limits.max_rounds
                                ? gain_of_round(noise[block], rounds[block])
                                : 0;
        if (gain > 0) offers.emplace(gain, block);
    };
    for (std::size_t i = 0; i < rounds.size(); ++i) offer(i);
    while (!offers.empty()) {
        const std::size_t block = offers.top().second;
        offers.pop();
        if (!budget.pay_round(noise[block])) continue;  // A smaller block may still fit.
        ++rounds[block];
        offer(block);
    }
}

double summed_squared_error(std::span<const BlockNoise> noise, std::span<const std::uint32_t> samples) {
    CHECK(noise.size() == samples.size(), noise.size(), samples.size());
    double sum = 0;
    for (std::size_t i = 0; i < noise.size(); ++i) {
        if (samples[i] == 0) return std::numeric_limits<double>::infinity();
        sum += noise[i].variance / double(samples[i]);
    }
    return sum;
}

double relative_error(double summed_squared_error, double mean, std::uint64_t pixels) {
    if (summed_squared_error == 0) return 0;
    return std::sqrt(summed_squared_error / double(k_channels * pixels)) / mean;
}

}  // namespace pathscope
