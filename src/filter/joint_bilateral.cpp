#include "pathscope/filter/joint_bilateral.hpp"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "filter/features.hpp"
#include "filter/filter_pass.hpp"
#include "filter/input_checks.hpp"

namespace pathscope {
namespace {

GuideUse guide_use(const BilateralParams& params) {
    return {params.sigma_normal, params.sigma_depth, params.sigma_albedo, params.demodulate_albedo};
}

/// The square around a pixel, row by row: each pixel sees its neighbours in this order, whoever computes it.
std::vector<Tap> square_of_taps(const Features& features, const BilateralParams& params) {
    const float scale = exponent_scale(params.sigma_spatial);
    std::vector<Tap> taps;
    for (int dy = -params.radius; dy <= params.radius; ++dy)
        for (int dx = -params.radius; dx <= params.radius; ++dx)
            taps.push_back({features.offset(dx, dy), float(dx * dx + dy * dy) * scale});
    return taps;
}

}  // namespace

Result<void> check_params(const BilateralParams& params) {
    if (params.radius < 0 || params.radius > k_max_filter_radius)
        return bad_input(fmt::format("A filter radius of {} is not possible: it is 0 to {} pixels.",
                                     params.radius, k_max_filter_radius));
    return check_sigmas({{"spatial", params.sigma_spatial},
                         {"normal", params.sigma_normal},
                         {"depth", params.sigma_depth},
                         {"albedo", params.sigma_albedo}});
}

Image joint_bilateral(const Image& noisy, const Guides& guides, const BilateralParams& params, int threads) {
    check_inputs(noisy, guides, params);
    if (params.radius == 0 || noisy.empty()) return noisy;

    const GuideUse use = guide_use(params);
    const Features features(noisy, guides, use, params.radius, 1, threads);
    const FilterPass pass{tap_kernel(simd_level()).by_guides, square_of_taps(features, params)};
    Image filtered(noisy.width, noisy.height);
    for_each_mean(features, 0, pass, noisy.rect(), threads, [&](int x, int y, const PixelMean& mean) {
        filtered.at(x, y) = filtered_colour(mean, noisy, guides, use, x, y);
    });
    return filtered;
}

Image joint_bilateral(const Image& noisy, const Guides& guides, const BilateralParams& params, PixelRect rect,
                      int threads) {
    const auto part = [&](const auto& guide) { return guide.empty() ? guide : crop(guide, rect); };
    return joint_bilateral(crop(noisy, rect), {part(guides.normal), part(guides.albedo), part(guides.depth)},
                           params, threads);
}

float bilateral_weight(const Guides& guides, const BilateralParams& params, int px, int py, int qx, int qy) {
    CHECK(check_params(params), params.radius);
    if (std::abs(px - qx) > params.radius || std::abs(py - qy) > params.radius) return 0;
    const auto term = [](double distance, float sigma) {
        return distance * distance / (double(sigma) * sigma);
    };

    double exponent = term(std::hypot(px - qx, py - qy), params.sigma_spatial);
    if (!guides.normal.empty())
        exponent += term(length(guides.normal.at(px, py) - guides.normal.at(qx, qy)), params.sigma_normal);
    if (!guides.albedo.empty())
        exponent += term(length(guides.albedo.at(px, py) - guides.albedo.at(qx, qy)), params.sigma_albedo);
    if (!guides.depth.empty()) {
        const float p = guides.depth.at(px, py), q = guides.depth.at(qx, qy);
        if (std::isnan(p) || std::isnan(q) || is_background(p) != is_background(q)) return 0;
        if (!is_background(p))
            exponent += term(std::log(double(p)) - std::log(double(q)), params.sigma_depth);
    }
    return std::isnan(exponent) ? 0 : float(std::exp(-0.5 * exponent));
}

}  // namespace pathscope
