#include "pathscope/sampling/distribution.hpp"

#include <algorithm>
#include <cmath>

#include "pathscope/core/check.hpp"

namespace pathscope {
namespace {

constexpr double k_steps = 1 << 24;  // uniform numbers are multiples of 1 / k_steps
constexpr int k_most_entries = 1 << 22;

/// Fills the cumulative sums of weights (one more than there are weights) and returns the total weight.
/// A total of zero leaves them undefined.
template <class Weight>
double fill_cdf(std::span<const Weight> weights, std::span<float> cdf) {
    double total = 0;
    int positive = 0;
    for (const Weight weight : weights) {
        CHECK(std::isfinite(weight) && weight >= 0, weight);
        total += weight;
        positive += weight > 0;
    }
    CHECK(positive <= k_most_entries, positive);

    // One step for each positive weight; the others are shared out in proportion.
    const double shared = k_steps - positive;
    double sum = 0;
    int seen = 0;
    cdf[0] = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        sum += weights[i];
        seen += weights[i] > 0;
        cdf[i + 1] = float((seen + std::floor(shared * std::min(1.0, sum / total) + 0.5)) / k_steps);
    }
    return total;
}

/// The entry whose share of [0, 1) holds u. Entries of weight zero hold nothing, so they are never found.
int find_share(std::span<const float> cdf, float u) {
    const auto above = std::upper_bound(cdf.begin(), cdf.end(), u);
    return int(above - cdf.begin()) - 1;
}

float place_in_share(std::span<const float> cdf, int index, float u) {
    return std::min((u - cdf[index]) / (cdf[index + 1] - cdf[index]), k_one_minus_epsilon);
}

int pixel_of(float x, int count) { return std::min(int(x * float(count)), count - 1); }

/// The coordinate in [0, 1) at `place` within pixel `index`; rounding never carries it into a neighbour.
float coordinate(int index, float place, int count) {
    float x = std::min((float(index) + place) / float(count), k_one_minus_epsilon);
    while (pixel_of(x, count) > index) x = std::nextafter(x, 0.0f);
    while (pixel_of(x, count) < index) x = std::nextafter(x, 1.0f);
    return x;
}

}  // namespace

std::optional<Distribution1d> Distribution1d::make(std::span<const float> weights) {
    Distribution1d distribution;
    distribution.cdf_.resize(weights.size() + 1);
    if (fill_cdf(weights, distribution.cdf_) == 0) return std::nullopt;
    return distribution;
}

Distribution1d::Pick Distribution1d::sample(float u) const {
    const int index = find(u);
    return {index, pmf(index), place_in_share(cdf_, index, u)};
}

int Distribution1d::find_by_halves(float u) const { return find_share(cdf_, u); }

std::optional<Distribution2d> Distribution2d::make(std::span<const float> weights, int width, int height) {
    CHECK(width >= 0 && height >= 0 && weights.size() == std::size_t(width) * height, width, height,
          weights.size());
    Distribution2d distribution;
    distribution.width_ = width;
    distribution.height_ = height;
    distribution.rows_cdf_.resize(std::size_t(height) + 1);
    distribution.columns_cdf_.resize(std::size_t(height) * (width + 1));

    std::vector<double> row_weights(height);
    for (int row = 0; row < height; ++row) {
        const std::span<float> cdf(&distribution.columns_cdf_[std::size_t(row) * (width + 1)], width + 1);
        row_weights[row] = fill_cdf(weights.subspan(std::size_t(row) * width, width), cdf);
        if (row_weights[row] == 0) std::fill(cdf.begin(), cdf.end(), 0.0f);
    }
    if (fill_cdf(std::span<const double>(row_weights), distribution.rows_cdf_) == 0) return std::nullopt;
    return distribution;
}

std::span<const float> Distribution2d::row_cdf(int row) const {
    return std::span(columns_cdf_).subspan(std::size_t(row) * (width_ + 1), width_ + 1);
}

Distribution2d::Pick Distribution2d::sample(Vec2 u) const {
    CHECK(u.x >= 0 && u.x < 1 && u.y >= 0 && u.y < 1, u.x, u.y);
    const int row = find_share(rows_cdf_, u.y);
    const std::span<const float> columns = row_cdf(row);
    const int column = find_share(columns, u.x);
    const float x = coordinate(column, place_in_share(columns, column, u.x), width_);
    const float y = coordinate(row, place_in_share(rows_cdf_, row, u.y), height_);
    const float pmf = (rows_cdf_[row + 1] - rows_cdf_[row]) * (columns[column + 1] - columns[column]);
    return {{x, y}, pmf * float(width_) * float(height_)};
}

float Distribution2d::pdf_square(Vec2 point) const {
    CHECK(point.x >= 0 && point.x < 1 && point.y >= 0 && point.y < 1, point.x, point.y);
    const int row = pixel_of(point.y, height_);
    const int column = pixel_of(point.x, width_);
    const std::span<const float> columns = row_cdf(row);
    const float pmf = (rows_cdf_[row + 1] - rows_cdf_[row]) * (columns[column + 1] - columns[column]);
    return pmf * float(width_) * float(height_);
}

}  // namespace pathscope
