#include "statistics.hpp"

#include "pathscope/math/random.hpp"
#include "pathscope/sampling/warp.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

TEST_CASE("chi-square p-values agree with printed tables") {
    CHECK(chi_square_p_value(3.841459, 1) == doctest::Approx(0.05).epsilon(1e-5));
    CHECK(chi_square_p_value(18.307038, 10) == doctest::Approx(0.05).epsilon(1e-5));
    CHECK(chi_square_p_value(3.940299, 10) == doctest::Approx(0.95).epsilon(1e-5));
    CHECK(chi_square_p_value(149.449253, 100) == doctest::Approx(0.001).epsilon(1e-4));
    CHECK(chi_square_p_value(0, 5) == 1);
    // Two degrees of freedom: exp(-x/2), on both sides of the switch between series and fraction.
    for (const double x : {0.1, 1.0, 3.9, 4.1, 20.0, 200.0})
        CHECK(chi_square_p_value(x, 2) == doctest::Approx(std::exp(-x / 2)).epsilon(1e-12));
    // Many: nearly normal with mean k and variance 2k.
    CHECK(chi_square_p_value(10'000, 10'000) == doctest::Approx(0.5).epsilon(0.01));
}

TEST_CASE("normal p-values and Sidak's threshold") {
    CHECK(normal_two_sided_p(1.959964) == doctest::Approx(0.05).epsilon(1e-5));
    CHECK(normal_two_sided_p(-2.575829) == doctest::Approx(0.01).epsilon(1e-5));
    CHECK(sidak_threshold(0.05, 1) == doctest::Approx(0.05));
    CHECK(sidak_threshold(0.01, 100) == doctest::Approx(1 - std::pow(0.99, 0.01)));
}

TEST_CASE("chi_square_test pools thin cells and refuses the impossible") {
    // By hand: (12-10)^2/10 + (8-10)^2/10 = 0.8; the cells of 2 and 4 make one of 6 that fits.
    const ChiSquare pooled = chi_square_test({12, 8, 3, 3}, {10, 10, 2, 4});
    CHECK(pooled.statistic == doctest::Approx(0.8));
    CHECK(pooled.dof == 2);
    CHECK(chi_square_test({10, 10, 1}, {10.5, 10.5, 0}).p_value == 0);
    // A thin rest joins the cell before it.
    CHECK(chi_square_test({3, 3, 3}, {3, 3, 3}).dof == 0);
}

TEST_CASE("p-values of a true hypothesis are uniform themselves") {
    HashRng rng(3);
    const int experiments = 400;
    std::vector<double> observed(10), expected(10, experiments / 10.0);
    for (int e = 0; e < experiments; ++e) {
        std::vector<double> counts(20), uniform(20, 1000 / 20.0);
        for (int i = 0; i < 1000; ++i) ++counts[std::size_t(rng.next_float() * 20)];
        ++observed[std::size_t(std::min(9.0, chi_square_test(counts, uniform).p_value * 10))];
    }
    CHECK(chi_square_test(observed, expected).p_value > k_significance);
}

TEST_CASE("integrate_sphere_patch: a lobe of known mass, and a cap of known area") {
    // n+1 / 2pi cos^n integrates to 1 over the hemisphere.
    const auto lobe = [](Vec3 w) { return w.z <= 0 ? 0 : 101 / (2 * std::numbers::pi) * std::pow(w.z, 100); };
    CHECK(integrate_sphere_patch(lobe, 0, 1, 0, 2 * std::numbers::pi, 1e-9) ==
          doctest::Approx(1).epsilon(1e-7));
    const auto one = [](Vec3) { return 1.0; };
    CHECK(integrate_sphere_patch(one, 0.5, 1, 0, 1, 1e-9) == doctest::Approx(0.5));
}

TEST_CASE("chi_square_sphere tells a right density from a wrong one") {
    HashRng rng(1);
    const auto sample = [&](int) -> std::optional<Vec3> {
        const Vec2 u{rng.next_float(), rng.next_float()};
        const Vec3 w = sample_cosine_hemisphere(u);
        if (rng.next_float() < 0.2f) return std::nullopt;
        return w;
    };
    const auto right = [](Vec3 w) { return 0.8f * sample_cosine_hemisphere_pdf(w); };
    const SphereTest good = chi_square_sphere(sample, right, 100'000);
    CHECK(good.p_value > k_significance);
    CHECK(good.pdf_integral == doctest::Approx(0.8).epsilon(1e-6));
    // An exponent of 1.06 where it is 1 is found; so is a density that forgets the rejected fifth.
    const auto steeper = [](Vec3 w) {
        return w.z <= 0 ? 0 : 0.8f * 2.06f / (2 * k_pi) * std::pow(w.z, 1.06f);
    };
    CHECK(chi_square_sphere(sample, steeper, 400'000).p_value < 1e-6);
    const auto forgetful = [](Vec3 w) { return sample_cosine_hemisphere_pdf(w); };
    CHECK(chi_square_sphere(sample, forgetful, 100'000).p_value < 1e-6);
}

TEST_CASE("Moments: mean, variance and standard error by hand") {
    Moments moments;
    for (const double x : {1e9 + 1, 1e9 + 2, 1e9 + 3, 1e9 + 4}) moments.add(x);
    CHECK(moments.mean() == 1e9 + 2.5);
    CHECK(moments.variance() == doctest::Approx(5.0 / 3));
    CHECK(moments.standard_error() == doctest::Approx(std::sqrt(5.0 / 12)));
}
