#include "filter/features.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "filter/portable_log.hpp"
#include "pathscope/core/parallel_for.hpp"

namespace pathscope {
namespace {

using PixelValues = std::array<float, k_guide_planes + k_colour_planes>;

template <class Pixel>
std::span<const Pixel> row_of(const Raster<Pixel>& guide, int y) {
    return guide.empty() ? std::span<const Pixel>{} : guide.row(y);
}

/// What a row of the picture is made of; where a guide is not used, nothing.
struct SourceRow {
    std::span<const Rgb> noisy, albedo;
    std::span<const Vec3> normal;
    std::span<const float> depth;

    SourceRow(const Image& image, const Guides& guides, int y)
        : noisy(image.row(y)),
          albedo(row_of(guides.albedo, y)),
          normal(row_of(guides.normal, y)),
          depth(row_of(guides.depth, y)) {}
};

/// From the picture's units to those of the planes: guides are multiplied by the root of their exponent_scale().
class FeatureSpace {
  public:
    explicit FeatureSpace(const GuideUse& use)
        : normal_(std::sqrt(exponent_scale(use.sigma_normal))),
          depth_(std::sqrt(exponent_scale(use.sigma_depth))),
          albedo_(std::sqrt(exponent_scale(use.sigma_albedo))),
          demodulate_(use.demodulate_albedo) {}

    /// Not finite where something is not a number.
    [[nodiscard]] PixelValues values(const SourceRow& row, std::size_t x) const {
        const Vec3 n = row.normal.empty() ? Vec3{} : row.normal[x] * normal_;
        const Rgb a = row.albedo.empty() ? Rgb{} : row.albedo[x] * albedo_;
        const float z = row.depth.empty() ? 0 : depth(row.depth[x]);
        const Rgb c = demodulate_ ? row.noisy[x] / demodulator(row.albedo[x]) : row.noisy[x];
        return {n.x, n.y, n.z, z, a.x, a.y, a.z, c.x, c.y, c.z};
    }

  private:
    [[nodiscard]] float depth(float z) const {
        constexpr float k_background = 1e9f;  // No surface comes near: |ln z| < 104, over k_min_filter_sigma.
        if (std::isnan(z)) return z;
        return is_background(z) ? k_background : portable_log(z) * depth_;
    }

    float normal_, depth_, albedo_;
    bool demodulate_;
};

/// Zero times a finite number is zero, and times anything else is none: no branch for each value.
bool all_finite(const PixelValues& values) {
    float sum = 0;
    for (const float value : values) sum += value * 0;
    return sum == 0;
}

/// One cache line more than a multiple of eight: with strides of a power of two (a width of 1024), all planes of a row
/// would compete for the same few places of the cache.
std::size_t stride_for(std::size_t width) { return (width + 127) / 128 * 128 + 16; }

}  // namespace

Rgb demodulator(Rgb albedo) {
    constexpr float k_smallest = 1.0f / 64;
    return max(albedo, Rgb{k_smallest, k_smallest, k_smallest});
}

float exponent_scale(float sigma) {
    constexpr double k_log2_e = 1.4426950408889634;
    return float(k_log2_e / 2 / (double(sigma) * double(sigma)));
}

bool is_background(float depth) { return depth <= 0 || std::isinf(depth); }

Features::Features(const Image& noisy, const Guides& guides, const GuideUse& use, int reach, int colour_sets,
                   int threads)
    : height_(noisy.height),
      reach_(reach),
      planes_(k_guide_planes + std::size_t(colour_sets) * k_colour_planes),
      stride_(stride_for(std::size_t(noisy.width + 2 * reach + k_padding))),
      values_(HugePageAllocator<float>().allocate(size())) {
    const FeatureSpace space(use);
    parallel_for(noisy.height + 2 * reach, threads, [&](int row) {
        const int y = row - reach;
        clear_row(y);
        if (y < 0 || y >= noisy.height) return;
        const SourceRow source(noisy, guides, y);
        float* const first = values_ + place(0, y);
        const std::size_t stride = stride_;  // Of its own, lest it be read again after each store.
        for (std::size_t x = 0; x < source.noisy.size(); ++x) {
            const PixelValues values = space.values(source, x);
            if (!all_finite(values)) continue;
            for (std::size_t k = 0; k < values.size(); ++k) first[k * stride + x] = values[k];
        }
    });
}

Features::~Features() { HugePageAllocator<float>().deallocate(values_, size()); }

/// A row of pixels that lend nothing.
void Features::clear_row(int y) {
    float* const row = values_ + std::size_t(y + reach_) * planes_ * stride_;
    std::fill_n(row, stride_, std::numeric_limits<float>::quiet_NaN());
    std::fill_n(row + stride_, (planes_ - 1) * stride_, 0.0f);
}

}  // namespace pathscope
