#pragma once
/// Picking by weight: an entry of a list, or a point of a picture whose pixels are densities.
///
///   P(i) = w_i / sum w
///
/// Exactly what is reported is what happens. Uniform numbers are multiples of 2^-24 (sampler.hpp), so the
/// cumulative sums are rounded to such multiples, and the probability of an entry is the number of multiples
/// it holds. Each entry of positive weight is given one of them beforehand: however small, it can be picked,
/// and the estimator stays unbiased. So P(i) differs from w_i / sum w by at most count / 2^24, and
/// pmf(i) says by how much.
/// Zero weights are never picked. A list without any positive weight has no distribution: make() gives none.
///
/// Why inversion and not an alias table: it is monotone in u, which keeps a low-discrepancy sampler's
/// strata; the search is log2(count) steps.
/// Requires: weights finite and >= 0; at most 2^22 entries with positive weight (2^22 columns, 2^22 rows).
/// Thread safety: const after make().   Test: tests/sampling/test_distribution.cpp

#include <optional>
#include <span>
#include <vector>

#include "pathscope/core/check.hpp"
#include "pathscope/math/vec.hpp"

namespace pathscope {

/// A list of weights; picks an index.
class Distribution1d {
  public:
    struct Pick {
        int index = 0;
        float pmf = 0;  ///< Probability of that index, > 0.
        float remainder =
            0;  ///< Where in the index's share u fell, uniform in [0, 1), with 24 + log2(pmf) bits
                ///< left of its 24: enough to reuse for short lists only.
    };

    [[nodiscard]] static std::optional<Distribution1d> make(std::span<const float> weights);

    [[nodiscard]] Pick sample(float u) const;
    /// The index alone. Requires: u in [0, 1).
    [[nodiscard]] int find(float u) const {
        CHECK(u >= 0 && u < 1, u);
        // Where the entry's share ends above u. Short lists, such as lights, are soon walked through from their start.
        if (cdf_.size() > k_short_list) return find_by_halves(u);
        int index = 0;
        while (!(u < cdf_[std::size_t(index) + 1])) ++index;
        return index;
    }
    [[nodiscard]] float pmf(int index) const { return cdf_[index + 1] - cdf_[index]; }
    [[nodiscard]] int size() const { return int(cdf_.size()) - 1; }

  private:
    static constexpr std::size_t k_short_list = 9;
    [[nodiscard]] int find_by_halves(float u) const;

    std::vector<float> cdf_;  // size() + 1 multiples of 2^-24 from 0 to 1
};

/// A picture of weights on the unit square, constant within each pixel; picks a point.
///
/// Convention: x to the right over the columns, y downwards over the rows, both in [0, 1).
/// pdf_square is the density per area of the unit square: the caller multiplies by the area's change under
/// its own mapping (for a latitude-longitude map: pdf_solid_angle = pdf_square / (2 pi^2 sin theta)).
class Distribution2d {
  public:
    struct Pick {
        Vec2 point;
        float pdf_square = 0;
    };

    /// weights: width * height, top row first.
    [[nodiscard]] static std::optional<Distribution2d> make(std::span<const float> weights, int width,
                                                            int height);

    [[nodiscard]] Pick sample(Vec2 u) const;
    /// Requires: point in [0, 1)^2.
    [[nodiscard]] float pdf_square(Vec2 point) const;
    [[nodiscard]] int width() const { return width_; }
    [[nodiscard]] int height() const { return height_; }

  private:
    [[nodiscard]] std::span<const float> row_cdf(int row) const;

    int width_ = 0, height_ = 0;
    std::vector<float> rows_cdf_;     // height + 1: which row
    std::vector<float> columns_cdf_;  // height times (width + 1): which column of that row
};

}  // namespace pathscope
