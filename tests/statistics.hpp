#pragma once
/// Statistics for tests: how likely is it that a correct program gives such a result?
///
/// A test names its confidence once for the whole family of comparisons it makes and fixes its seeds, so that
/// it passes always or never:
///
///     const double threshold = sidak_threshold(k_significance, number_of_tests);
///     CHECK(chi_square_sphere(...).p_value > threshold);
///
/// With k_significance = 0.001 one correct test program in a thousand would fail; a seed that does is simply
/// not the one committed. A wrong sampler gives p of 1e-10 and below.
/// See: Subr & Arvo 2007, "Statistical Hypothesis Testing for Assessing Monte Carlo Estimators".
/// Test: tests/sampling/test_statistics.cpp

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <optional>
#include <vector>

#include "pathscope/math/vec.hpp"

namespace pathscope::testing {

inline constexpr double k_significance = 0.001;

/// Each of n independent comparisons may use this threshold, and all of them together then fail a correct
/// program with probability alpha (Sidak's correction).
inline double sidak_threshold(double alpha, int n) { return -std::expm1(std::log1p(-alpha) / n); }

/// P(|Z| >= |z|) for a standard normal Z.
inline double normal_two_sided_p(double z) { return std::erfc(std::abs(z) / std::numbers::sqrt2); }

/// Upper regularised incomplete gamma function Q(a, x): its power series' complement where that converges
/// fast (x < a + 1), its continued fraction (by Lentz's method) elsewhere.
inline double upper_incomplete_gamma(double a, double x) {
    if (x <= 0) return 1;
    const double front = std::exp(a * std::log(x) - x - std::lgamma(a));
    if (x < a + 1) {
        double term = 1 / a, sum = term;
        for (double n = a + 1; term > 1e-16 * sum; ++n) sum += term *= x / n;
        return std::max(0.0, 1 - front * sum);
    }
    constexpr double k_tiny = 1e-300;  // stands in for a zero denominator
    const auto nonzero = [](double v) { return std::abs(v) < k_tiny ? k_tiny : v; };
    double b = x + 1 - a, c = 1 / k_tiny, d = 1 / nonzero(b), fraction = d;
    for (int i = 1; i < 100'000; ++i) {
        const double numerator = -i * (i - a);
        b += 2;
        d = 1 / nonzero(numerator * d + b);
        c = nonzero(b + numerator / c);
        fraction *= d * c;
        if (std::abs(d * c - 1) < 1e-15) break;
    }
    return front * fraction;
}

/// P(X >= statistic) for X chi-square distributed with dof degrees of freedom.
inline double chi_square_p_value(double statistic, int dof) {
    return dof <= 0 ? 1.0 : upper_incomplete_gamma(0.5 * dof, 0.5 * statistic);
}

struct ChiSquare {
    double statistic = 0;
    int dof = 0;
    double p_value = 1;
};

/// Pearson's test of counts against expected counts, of equal total. Cells that expect fewer than five are
/// pooled, because the statistic is chi-square distributed for large counts only. A count where nothing is
/// expected fails outright (p = 0).
inline ChiSquare chi_square_test(const std::vector<double>& observed, const std::vector<double>& expected) {
    constexpr double k_least_expected = 5;
    std::vector<std::size_t> order(expected.size());
    std::iota(order.begin(), order.end(), std::size_t(0));
    std::sort(order.begin(), order.end(), [&](auto a, auto b) { return expected[a] < expected[b]; });

    struct Cell {
        double observed = 0, expected = 0;
    };
    std::vector<Cell> cells{Cell{}};
    for (const std::size_t i : order) {
        if (expected[i] <= 0 && observed[i] > 0) return {1e300, 1, 0};
        if (cells.back().expected >= k_least_expected) cells.push_back({});
        cells.back().observed += observed[i];
        cells.back().expected += expected[i];
    }
    if (cells.size() > 1 && cells.back().expected < k_least_expected) {
        cells[cells.size() - 2].observed += cells.back().observed;
        cells[cells.size() - 2].expected += cells.back().expected;
        cells.pop_back();
    }

    ChiSquare result;
    for (const Cell& cell : cells)
        if (cell.expected > 0)
            result.statistic +=
                (cell.observed - cell.expected) * (cell.observed - cell.expected) / cell.expected;
    result.dof = int(cells.size()) - 1;
    result.p_value = chi_square_p_value(result.statistic, result.dof);
    return result;
}

/// The integral of f over a rectangle by 3x3 Gauss-Legendre points, divided in four until that changes nothing
/// beyond `tolerance` (absolute, for the whole rectangle). At least `least_depth` divisions are made first, so
/// that narrow peaks are met.
template <class F>
class RectangleIntegral {
  public:
    RectangleIntegral(const F& f, int most_depth) : f_(f), most_depth_(most_depth) {}

    double operator()(double x0, double x1, double y0, double y1, double tolerance, int least_depth) const {
        if (least_depth > 0) {
            const double xm = 0.5 * (x0 + x1), ym = 0.5 * (y0 + y1), quarter = tolerance / 4;
            return (*this)(x0, xm, y0, ym, quarter, least_depth - 1) +
                   (*this)(xm, x1, y0, ym, quarter, least_depth - 1) +
                   (*this)(x0, xm, ym, y1, quarter, least_depth - 1) +
                   (*this)(xm, x1, ym, y1, quarter, least_depth - 1);
        }
        return refine(x0, x1, y0, y1, gauss(x0, x1, y0, y1), tolerance, most_depth_);
    }

  private:
    double refine(double x0, double x1, double y0, double y1, double coarse, double tolerance,
                  int depth) const {
        const double xm = 0.5 * (x0 + x1), ym = 0.5 * (y0 + y1);
        const double a = gauss(x0, xm, y0, ym), b = gauss(xm, x1, y0, ym);
        const double c = gauss(x0, xm, ym, y1), d = gauss(xm, x1, ym, y1);
        const double fine = a + b + c + d, quarter = tolerance / 4;
        if (depth == 0 || std::abs(fine - coarse) < tolerance) return fine;
        return refine(x0, xm, y0, ym, a, quarter, depth - 1) + refine(xm, x1, y0, ym, b, quarter, depth - 1) +
               refine(x0, xm, ym, y1, c, quarter, depth - 1) + refine(xm, x1, ym, y1, d, quarter, depth - 1);
    }

    double gauss(double x0, double x1, double y0, double y1) const {
        constexpr double k_node = 0.77459666924148337704;  // sqrt(3/5)
        constexpr double k_nodes[3] = {-k_node, 0, k_node}, k_weights[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
        double sum = 0;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                sum += k_weights[i] * k_weights[j] *
                       f_(0.5 * (x0 + x1 + (x1 - x0) * k_nodes[i]), 0.5 * (y0 + y1 + (y1 - y0) * k_nodes[j]));
        return sum * (x1 - x0) * (y1 - y0);
    }

    const F& f_;
    int most_depth_;
};

/// The integral of f(direction) over the part of the sphere with z and azimuth (in radians) in the given
/// ranges.
template <class F>
double integrate_sphere_patch(const F& f, double z0, double z1, double phi0, double phi1, double tolerance,
                              int least_depth = 1) {
    const auto along = [&f](double z, double phi) {
        const double r = std::sqrt(std::max(0.0, 1 - z * z));
        return double(f(Vec3{float(r * std::cos(phi)), float(r * std::sin(phi)), float(z)}));
    };
    constexpr int k_most_depth = 8;
    return RectangleIntegral(along, k_most_depth)(z0, z1, phi0, phi1, tolerance, least_depth);
}

/// Compares sampled directions with their density, in cells of equal solid angle (z by azimuth).
///
/// sample(i) returns the i-th direction or nothing, pdf(direction) the density per solid angle. What is
/// sampled as nothing is a cell too, which expects what the density lacks to 1: so lost mass is tested as well.
/// Requires: samples independent (no low-discrepancy points: those fit too well). The density may jump where
/// z is 0 and must be smooth at the scale of a cell over 2^(least_depth + 1).
struct SphereTest {
    ChiSquare chi_square;
    double p_value = 1;
    double pdf_integral = 0;  ///< Over the whole sphere.
    int rejected = 0;         ///< Samples that were nothing.
};
template <class Sample, class Pdf>
SphereTest chi_square_sphere(const Sample& sample, const Pdf& pdf, int samples, int z_cells = 24,
                             int phi_cells = 48, int least_depth = 1) {
    SphereTest result;
    const int cells = z_cells * phi_cells;
    std::vector<double> observed(std::size_t(cells) + 1), expected(std::size_t(cells) + 1);
    for (int i = 0; i < samples; ++i) {
        const std::optional<Vec3> direction = sample(i);
        if (!direction) {
            ++result.rejected;
            ++observed.back();
            continue;
        }
        const double turns = std::atan2(direction->y, direction->x) / (2 * std::numbers::pi);
        const int z = int(0.5 * (double(direction->z) + 1) * z_cells);
        const int phi = int((turns < 0 ? turns + 1 : turns) * phi_cells);
        ++observed[std::size_t(std::clamp(z, 0, z_cells - 1) * phi_cells +
                               std::clamp(phi, 0, phi_cells - 1))];
    }
    // An error of a tenth of a count in each cell disappears in the noise of the counts.
    const double tolerance = 0.1 / samples;
    for (int z = 0; z < z_cells; ++z)
        for (int phi = 0; phi < phi_cells; ++phi) {
            const double step_z = 2.0 / z_cells, step_phi = 2 * std::numbers::pi / phi_cells;
            const double mass =
                integrate_sphere_patch(pdf, -1 + z * step_z, -1 + (z + 1) * step_z, phi * step_phi,
                                       (phi + 1) * step_phi, tolerance, least_depth);
            expected[std::size_t(z * phi_cells + phi)] = mass * samples;
            result.pdf_integral += mass;
        }
    // Below one count, the missing mass is rounding.
    const double missing = (1 - result.pdf_integral) * samples;
    expected.back() = missing > 1 || result.rejected > 0 ? std::max(missing, 1e-9) : 0;
    result.chi_square = chi_square_test(observed, expected);
    result.p_value = result.chi_square.p_value;
    return result;
}

/// Mean, variance and standard error of a stream of numbers (Welford's update, which does not cancel).
class Moments {
  public:
    void add(double x) {
        ++count_;
        const double delta = x - mean_;
        mean_ += delta / count_;
        squares_ += delta * (x - mean_);
    }
    std::int64_t count() const { return count_; }
    double mean() const { return mean_; }
    double variance() const { return count_ > 1 ? squares_ / double(count_ - 1) : 0; }
    double standard_error() const { return count_ > 0 ? std::sqrt(variance() / double(count_)) : 0; }

  private:
    std::int64_t count_ = 0;
    double mean_ = 0, squares_ = 0;
};

}  // namespace pathscope::testing
