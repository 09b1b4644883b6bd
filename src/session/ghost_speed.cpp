#include "pathscope/session/ghost_speed.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

#include "pathscope/math/random.hpp"

namespace pathscope {
namespace {

constexpr std::string_view k_lognormal = "lognormal:";

std::optional<double> number_within(std::string_view text, double least, double most) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    if (!(value >= least && value <= most)) return std::nullopt;
    return value;
}

/// By Box and Muller.
double standard_normal(HashRng rng) {
    const double radius = std::sqrt(-2 * std::log(1 - double(rng.next_float())));
    return radius * std::cos(2 * std::numbers::pi * double(rng.next_float()));
}

}  // namespace

Result<GhostSpeed> parse_ghost_speed(std::string_view text) {
    const std::size_t comma = text.find(',');
    const std::optional<double> median = number_within(text.substr(0, comma), 1, 1e12);
    std::optional<double> sigma = 0.0;
    if (comma != std::string_view::npos) {
        const std::string_view spread = text.substr(comma + 1);
        sigma = spread.starts_with(k_lognormal) ? number_within(spread.substr(k_lognormal.size()), 0, 2)
                                                : std::nullopt;
    }
    if (!median || !sigma)
        return bad_input(
            fmt::format("'{}' is not a speed from 1 to 1e12 samples per second, as in 100000 or "
                        "100000,lognormal:0.4 (at most lognormal:2)",
                        text));
    return GhostSpeed{*median, *sigma};
}

std::string to_text(const GhostSpeed& speed) {
    return speed.sigma == 0 ? fmt::format("{}", speed.median)
                            : fmt::format("{},{}{}", speed.median, k_lognormal, speed.sigma);
}

std::vector<double> ghost_speeds(const GhostSpeed& speed, int count, std::uint32_t seed) {
    std::vector<double> speeds;
    for (int i = 0; i < count; ++i) {
        const double z = standard_normal(HashRng(hash_combine(hash_u32(seed), std::uint32_t(i))));
        speeds.push_back(speed.median * std::exp(speed.sigma * z));
    }
    return speeds;
}

}  // namespace pathscope
