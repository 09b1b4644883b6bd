#include "pathscope/image/metrics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace pathscope {
namespace {

void check_same_size(const Image& a, const Image& b) {
    CHECK(!a.empty() && a.rect() == b.rect(), a.rect(), b.rect());
}

/// f(a, b) of every channel of every pixel, in order.
template <class Term>
void for_each_channel(const Image& a, const Image& b, Term&& term) {
    check_same_size(a, b);
    for (std::size_t i = 0; i < a.pixels.size(); ++i)
        for (int c = 0; c < 3; ++c) term(double(a.pixels[i][c]), double(b.pixels[i][c]));
}

double square(double x) { return x * x; }

/// Means over the whole blocks of a picture, channel by channel, counted from the left and the bottom.
std::vector<double> block_means(const Image& image, int size) {
    std::vector<double> means;
    for (int y = image.height % size; y < image.height; y += size) {
        for (int x = 0; x + size <= image.width; x += size) {
            double sum[3] = {};
            for (int dy = 0; dy < size; ++dy)
                for (const Rgb pixel : image.row(y + dy).subspan(std::size_t(x), std::size_t(size)))
                    for (int c = 0; c < 3; ++c) sum[c] += double(pixel[c]);
            for (const double s : sum) means.push_back(s / square(size));
        }
    }
    return means;
}

/// z of one channel; no variance on either side leaves only "equal" and "not equal".
double z_score(double mean_a, double mean_b, double variance_of_difference) {
    const double difference = mean_a - mean_b;
    if (variance_of_difference == 0)
        return difference == 0 ? 0 : std::copysign(std::numeric_limits<double>::infinity(), difference);
    return difference / std::sqrt(variance_of_difference);
}

}  // namespace

double mean(const Image& image) {
    double sum = 0;
    for_each_channel(image, image, [&](double value, double) { sum += value; });
    return sum / (3.0 * double(image.pixels.size()));
}

double rmse(const Image& a, const Image& b) {
    double sum = 0;
    for_each_channel(a, b, [&](double x, double y) { sum += square(x - y); });
    return std::sqrt(sum / (3.0 * double(a.pixels.size())));
}

double rel_mse(const Image& image, const Image& reference, const RelMseParams& params) {
    CHECK(params.epsilon > 0 && params.trimmed >= 0 && params.trimmed < 1, params.epsilon, params.trimmed);
    std::vector<double> terms;
    terms.reserve(3 * image.pixels.size());
    for_each_channel(image, reference, [&](double x, double r) {
        terms.push_back(square(x - r) / (square(r) + params.epsilon));
    });
    for (const double term : terms)
        if (std::isnan(term)) return term;

    const auto dropped = std::size_t(params.trimmed * double(terms.size()));
    if (dropped > 0) {
        std::sort(terms.begin(), terms.end());
        terms.resize(terms.size() - dropped);
    }
    double sum = 0;
    for (const double term : terms) sum += term;
    return sum / double(terms.size());
}

bool BlockComparison::close() const {
    return median <= 0.02 && percentile_95 <= 0.08 && std::abs(ratio_of_means - 1) <= 0.01;
}

BlockComparison compare_blocks(const Image& image, const Image& reference, int block_size) {
    check_same_size(image, reference);
    CHECK(block_size >= 1 && block_size <= image.width && block_size <= image.height, block_size,
          image.rect());
    const double mean_reference = mean(reference);
    const std::vector<double> ours = block_means(image, block_size);
    const std::vector<double> theirs = block_means(reference, block_size);

    std::vector<double> errors(ours.size());
    for (std::size_t i = 0; i < ours.size(); ++i)
        errors[i] = std::abs(ours[i] - theirs[i]) / (theirs[i] + 0.01 * mean_reference);
    for (const double error : errors)  // No order sorts what is not a number.
        if (std::isnan(error)) return {error, error, mean(image) / mean_reference};

    std::sort(errors.begin(), errors.end());
    return {errors[errors.size() / 2], errors[std::size_t(0.95 * double(errors.size()))],
            mean(image) / mean_reference};
}

double max_abs_z(const Image& mean_a, const Image& variance_a, std::uint32_t n_a, const Image& mean_b,
                 const Image& variance_b, std::uint32_t n_b) {
    CHECK(n_a >= 1 && n_b >= 1, n_a, n_b);
    check_same_size(mean_a, mean_b);
    check_same_size(mean_a, variance_a);
    check_same_size(mean_a, variance_b);
    double largest = 0;
    for (std::size_t i = 0; i < mean_a.pixels.size(); ++i) {
        for (int c = 0; c < 3; ++c) {
            const double variance =
                double(variance_a.pixels[i][c]) / n_a + double(variance_b.pixels[i][c]) / n_b;
            const double z = z_score(double(mean_a.pixels[i][c]), double(mean_b.pixels[i][c]), variance);
            if (std::isnan(z)) return z;
            largest = std::max(largest, std::abs(z));
        }
    }
    return largest;
}

double sidak_z_limit(std::int64_t comparisons, double alpha) {
    CHECK(comparisons >= 1 && alpha > 0 && alpha < 1, comparisons, alpha);
    // 1 - (1 - alpha)^(1/m), written so that it keeps its digits when m is large.
    const double tail = -std::expm1(std::log1p(-alpha) / double(comparisons));
    double low = 0, high = 40;  // P(|z| > 40) is below the smallest double.
    for (int i = 0; i < 100; ++i) {
        const double middle = 0.5 * (low + high);
        (std::erfc(middle / std::sqrt(2.0)) > tail ? low : high) = middle;
    }
    return high;
}

}  // namespace pathscope
