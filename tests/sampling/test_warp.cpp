#include "pathscope/sampling/warp.hpp"

#include "pathscope/math/random.hpp"
#include "statistics.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr int k_samples = k_sanitized ? 50'000 : 500'000;
const double k_threshold = sidak_threshold(k_significance, 8);

Vec2 next_2d(HashRng& rng) {
    const float x = rng.next_float();
    return {x, rng.next_float()};
}

template <class Warp, class Pdf>
SphereTest test_directions(std::uint32_t seed, const Warp& warp, const Pdf& pdf) {
    HashRng rng(seed);
    const auto sample = [&](int) -> std::optional<Vec3> { return warp(next_2d(rng)); };
    return chi_square_sphere(sample, pdf, k_samples);
}

}  // namespace

TEST_CASE("unit_circle is cosine and sine to 1.2e-7, and exact on the axes") {
    double worst = 0;
    for (int i = 0; i <= 1 << 20; ++i) {
        const float turns = float(i) * 0x1p-20f;
        const double angle = 2 * std::numbers::pi * turns;
        const Vec2 p = unit_circle(turns);
        worst = std::max({worst, std::abs(p.x - std::cos(angle)), std::abs(p.y - std::sin(angle))});
    }
    CHECK(worst < 1.2e-7);
    CHECK(unit_circle(0.25f) == Vec2{0, 1});
    CHECK(unit_circle(0.5f) == Vec2{-1, 0});
    CHECK(unit_circle(0.75f) == Vec2{0, -1});
    CHECK(unit_circle(1) == Vec2{1, 0});
}

TEST_CASE("warps to directions have the densities they say (chi-square), which integrate to 1") {
    const SphereTest uniform = test_directions(1, sample_uniform_hemisphere,
                                               [](Vec3 w) { return sample_uniform_hemisphere_pdf(w); });
    CHECK(uniform.p_value > k_threshold);
    CHECK(uniform.pdf_integral == doctest::Approx(1).epsilon(1e-6));

    const SphereTest cosine =
        test_directions(2, sample_cosine_hemisphere, [](Vec3 w) { return sample_cosine_hemisphere_pdf(w); });
    CHECK(cosine.p_value > k_threshold);
    CHECK(cosine.pdf_integral == doctest::Approx(1).epsilon(1e-6));

    const SphereTest sphere =
        test_directions(3, sample_uniform_sphere, [](Vec3) { return sample_uniform_sphere_pdf(); });
    CHECK(sphere.p_value > k_threshold);
    CHECK(sphere.pdf_integral == doctest::Approx(1).epsilon(1e-6));

    // The rim at z = 0.25 lies between cells, so that the jump does not hurt the integration.
    const SphereTest cone = test_directions(
        4, [](Vec2 u) { return sample_cone(u, 0.75f); },
        [](Vec3 w) { return w.z > 0.25f ? sample_cone_pdf(0.75f) : 0.0f; });
    CHECK(cone.p_value > k_threshold);
    CHECK(cone.pdf_integral == doctest::Approx(1).epsilon(1e-6));
}

TEST_CASE("sample_disc is uniform by area (chi-square over radius squared and azimuth) and hits the centre") {
    HashRng rng(5);
    std::vector<double> observed(16 * 32), expected(observed.size(), k_samples / double(observed.size()));
    for (int i = 0; i < k_samples; ++i) {
        const Vec2 p = sample_disc(next_2d(rng));
        const double r2 = double(p.x) * p.x + double(p.y) * p.y;
        REQUIRE(r2 <= 1 + 1e-6);
        const double turns = std::atan2(p.y, p.x) / (2 * std::numbers::pi) + 0.5;
        ++observed[std::size_t(std::min(15, int(r2 * 16)) * 32 + std::min(31, int(turns * 32)))];
    }
    CHECK(chi_square_test(observed, expected).p_value > k_threshold);
    CHECK(sample_disc({0.5f, 0.5f}) == Vec2{0, 0});
    CHECK(sample_disc_pdf() == doctest::Approx(1 / std::numbers::pi));
}

TEST_CASE("sample_triangle is uniform over 16 x 16 congruent triangles (chi-square)") {
    HashRng rng(6);
    const int side = 16;
    std::vector<double> observed(2 * side * side), expected(observed.size());
    for (int i = 0; i < k_samples; ++i) {
        const Vec2 b = sample_triangle(next_2d(rng));
        REQUIRE(b.x >= 0);
        REQUIRE(b.y >= 0);
        REQUIRE(b.x + b.y <= 1);
        const float x = b.x * side, y = b.y * side;
        const int column = int(x), row = int(y);
        const bool upper = x - float(column) + y - float(row) > 1;
        ++observed[std::size_t(2 * (row * side + column) + upper)];
    }
    for (int row = 0; row < side; ++row)
        for (int column = 0; column + row < side; ++column) {
            expected[std::size_t(2 * (row * side + column))] = double(k_samples) / (side * side);
            if (column + row < side - 1)
                expected[std::size_t(2 * (row * side + column) + 1)] = double(k_samples) / (side * side);
        }
    CHECK(chi_square_test(observed, expected).p_value > k_threshold);
    CHECK(sample_triangle_pdf(0.5f) == 2);
}

TEST_CASE("moments by hand: E[z] = 2/3 under the cosine, 1/2 under the uniform hemisphere") {
    HashRng rng(7);
    Moments cosine, uniform;
    for (int i = 0; i < k_samples; ++i) {
        cosine.add(sample_cosine_hemisphere(next_2d(rng)).z);
        uniform.add(sample_uniform_hemisphere(next_2d(rng)).z);
    }
    CHECK(normal_two_sided_p((cosine.mean() - 2.0 / 3) / cosine.standard_error()) > k_threshold);
    CHECK(normal_two_sided_p((uniform.mean() - 0.5) / uniform.standard_error()) > k_threshold);
}

TEST_CASE("directions have length one and, of the hemisphere, stay above the surface") {
    HashRng rng(8);
    for (int i = 0; i < 100'000; ++i) {
        // The corners of the square, too.
        const Vec2 u = i == 0   ? Vec2{0, 0}
                       : i == 1 ? Vec2{k_one_minus_epsilon, k_one_minus_epsilon}
                       : i == 2 ? Vec2{k_one_minus_epsilon, 0}
                                : next_2d(rng);
        for (const Vec3 w : {sample_uniform_hemisphere(u), sample_cosine_hemisphere(u),
                             sample_uniform_sphere(u), sample_cone(u, 1e-5f)})
            REQUIRE(std::abs(length(w) - 1) < 3e-7f);
        REQUIRE(sample_uniform_hemisphere(u).z > 0);
        REQUIRE(sample_cosine_hemisphere(u).z >= 0);
    }
}

TEST_CASE("the cone of the sun keeps its angle and its density to 1e-6, where a float cosine keeps 1e-2") {
    const double half_angle = 0.265 * std::numbers::pi / 180;
    const float sine = float(std::sin(half_angle));
    const float one_minus_cos = one_minus_cos_from_sin2(sine * sine);
    CHECK(std::abs(one_minus_cos / (1 - std::cos(half_angle)) - 1) < 1e-6);
    const Vec3 rim = sample_cone({k_one_minus_epsilon, 0.125f}, one_minus_cos);
    CHECK(std::abs(std::hypot(rim.x, rim.y) / std::sin(half_angle) - 1) < 1e-6);
    CHECK(std::abs(sample_cone_pdf(one_minus_cos) * 2 * std::numbers::pi * (1 - std::cos(half_angle)) - 1) <
          1e-6);
}
