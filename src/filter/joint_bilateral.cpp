#include "pathscope/filter/joint_bilateral.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "exp_log.hpp"
#include "pathscope/core/parallel_for.hpp"

namespace pathscope {
namespace {

bool is_background(float depth) { return depth <= 0 || std::isinf(depth); }

/// exp(-t) of a distance, where sigma means what it means in the equation: t = distance^2 / (2 sigma^2). Guides are
/// multiplied by this once, and the loops only square and add.
float guide_scale(float sigma) { return float(1 / (double(sigma) * std::sqrt(2.0))); }

/// A picture as the loops want it: for each row, one array of floats for every coordinate of a pixel, `stride` apart.
///
///   0..2 normal, 3 log depth, 4..6 albedo, each over sigma * sqrt(2);  7..9 colour, demodulated if asked for
///
/// A pixel that must lend nothing has NaN as its first coordinate, so that every weight it is part of is zero, and
/// black as its colour, because zero times NaN would not be zero.
class Features {
  public:
    static constexpr int k_guides = 7;
    static constexpr int k_channels = k_guides + 3;

    Features(const Image& noisy, const Guides& guides, const BilateralParams& params, int threads)
        : stride_(stride_for(std::size_t(noisy.width))),
          values_(stride_ * k_channels * std::size_t(noisy.height)) {
        parallel_for(noisy.height, threads, [&](int y) {
            for (int x = 0; x < noisy.width; ++x) set_pixel(x, y, features_at(noisy, guides, params, x, y));
        });
    }

    [[nodiscard]] std::size_t stride() const { return stride_; }
    [[nodiscard]] const float* row(int y) const { return &values_[std::size_t(y) * k_channels * stride_]; }

    /// What the colour of a pixel is divided by before, and multiplied by after.
    static Rgb modulation(const Guides& guides, const BilateralParams& params, int x, int y) {
        if (!params.demodulate_albedo) return {1, 1, 1};
        constexpr float k_smallest = 1.0f / 64;
        return max(guides.albedo.at(x, y), Rgb{k_smallest, k_smallest, k_smallest});
    }

  private:
    using Pixel = std::array<float, k_channels>;

    /// One cache line more than a multiple of eight: with strides of a power of two (a width of 1024), all arrays of a
    /// row would compete for the same few places of the cache.
    static std::size_t stride_for(std::size_t width) { return (width + 127) / 128 * 128 + 16; }

    static Pixel features_at(const Image& noisy, const Guides& guides, const BilateralParams& params, int x,
                             int y) {
        const Vec3 normal = guides.normal.empty() ? Vec3{} : guides.normal.at(x, y);
        const Rgb albedo = guides.albedo.empty() ? Rgb{} : guides.albedo.at(x, y);
        const float depth = guides.depth.empty() ? 1 : guides.depth.at(x, y);
        const Rgb colour = noisy.at(x, y) / modulation(guides, params, x, y);
        if (!is_finite(normal) || !is_finite(albedo) || !is_finite(colour) || std::isnan(depth))
            return {std::numeric_limits<float>::quiet_NaN()};

        const Vec3 n = normal * guide_scale(params.sigma_normal);
        const Rgb a = albedo * guide_scale(params.sigma_albedo);
        constexpr float k_background = 1e9f;  // No surface comes near: |ln z| < 104, over k_min_filter_sigma.
        const float z =
            is_background(depth) ? k_background : portable_log(depth) * guide_scale(params.sigma_depth);
        return {n.x, n.y, n.z, z, a.x, a.y, a.z, colour.x, colour.y, colour.z};
    }

    void set_pixel(int x, int y, const Pixel& pixel) {
        for (std::size_t k = 0; k < k_channels; ++k)
            values_[(std::size_t(y) * k_channels + k) * stride_ + std::size_t(x)] = pixel[k];
    }

    std::size_t stride_;
    std::vector<float> values_;
};

/// The two sums of the equation for the pixels of one row.
struct RowSums {
    std::vector<float> weight, red, green, blue;

    explicit RowSums(std::size_t width) : weight(width), red(width), green(width), blue(width) {}
};

/// Adds to each of `count` pixels the one neighbour that lies at the same offset from it. The inner loop has no
/// branch, and its iterations nothing in common: it becomes vector code.
void add_neighbours(const float* own, const float* other, std::size_t stride, std::size_t count,
                    float spatial, float* __restrict weight, float* __restrict red, float* __restrict green,
                    float* __restrict blue) {
    for (std::size_t i = 0; i < count; ++i) {
        float distance = spatial;
        for (std::size_t k = 0; k < Features::k_guides; ++k) {
            const float difference = other[k * stride + i] - own[k * stride + i];
            distance += difference * difference;
        }
        const float w = exp_negative(distance);
        weight[i] += w;
        red[i] += w * other[(Features::k_guides + 0) * stride + i];
        green[i] += w * other[(Features::k_guides + 1) * stride + i];
        blue[i] += w * other[(Features::k_guides + 2) * stride + i];
    }
}

/// All neighbours of the pixels [first, last) of row y, offset by offset: each pixel sees them in the same order
/// whoever computes it.
void add_all_neighbours(const Features& features, const BilateralParams& params, PixelRect frame, int y,
                        int first, int last, RowSums& sums) {
    const float scale = guide_scale(params.sigma_spatial);
    for (int dy = std::max(-params.radius, -y); dy <= std::min(params.radius, frame.height - 1 - y); ++dy) {
        for (int dx = -params.radius; dx <= params.radius; ++dx) {
            const int begin = std::max(first, -dx);
            const int end = std::min(last, frame.width - dx);
            if (begin >= end) continue;
            const float spatial = float(dx * dx + dy * dy) * scale * scale;
            add_neighbours(features.row(y) + begin, features.row(y + dy) + begin + dx, features.stride(),
                           std::size_t(end - begin), spatial, &sums.weight[std::size_t(begin)],
                           &sums.red[std::size_t(begin)], &sums.green[std::size_t(begin)],
                           &sums.blue[std::size_t(begin)]);
        }
    }
}

/// A row in strips so short that what the inner loop reads again and again stays in the innermost cache.
RowSums sum_row(const Features& features, const BilateralParams& params, PixelRect frame, int y) {
    constexpr int k_strip = 128;
    RowSums sums(std::size_t(frame.width));
    for (int first = 0; first < frame.width; first += k_strip)
        add_all_neighbours(features, params, frame, y, first, std::min(first + k_strip, frame.width), sums);
    return sums;
}

void check_inputs(const Image& noisy, const Guides& guides, const BilateralParams& params) {
    const auto params_are_good = check_params(params);
    CHECK(params_are_good, params_are_good ? "" : params_are_good.error().message);
    const auto fits = [&](const auto& guide) { return guide.empty() || guide.rect() == noisy.rect(); };
    CHECK(fits(guides.normal) && fits(guides.albedo) && fits(guides.depth), noisy.rect(),
          guides.normal.rect(), guides.albedo.rect(), guides.depth.rect());
    CHECK(!params.demodulate_albedo || noisy.empty() || !guides.albedo.empty(), noisy.rect());
}

}  // namespace

Result<void> check_params(const BilateralParams& params) {
    if (params.radius < 0 || params.radius > k_max_filter_radius)
        return bad_input(fmt::format("A filter radius of {} is not possible: it is 0 to {} pixels.",
                                     params.radius, k_max_filter_radius));
    const std::pair<const char*, float> sigmas[] = {{"spatial", params.sigma_spatial},
                                                    {"normal", params.sigma_normal},
                                                    {"depth", params.sigma_depth},
                                                    {"albedo", params.sigma_albedo}};
    for (const auto& [name, sigma] : sigmas)
        if (!(sigma >= k_min_filter_sigma))
            return bad_input(fmt::format("A filter sigma_{} of {} is not possible: it is at least {}.", name,
                                         sigma, k_min_filter_sigma));
    return {};
}

Image joint_bilateral(const Image& noisy, const Guides& guides, const BilateralParams& params, int threads) {
    check_inputs(noisy, guides, params);
    if (params.radius == 0 || noisy.empty()) return noisy;

    const Features features(noisy, guides, params, threads);
    Image filtered(noisy.width, noisy.height);
    parallel_for(noisy.height, threads, [&](int y) {
        const RowSums sums = sum_row(features, params, noisy.rect(), y);
        for (int x = 0; x < noisy.width; ++x) {
            const std::size_t i = std::size_t(x);
            // A pixel always counts itself with weight 1, unless it is not a number.
            filtered.at(x, y) = sums.weight[i] == 0
                                    ? noisy.at(x, y)
                                    : Rgb{sums.red[i], sums.green[i], sums.blue[i]} / sums.weight[i] *
                                          Features::modulation(guides, params, x, y);
        }
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
