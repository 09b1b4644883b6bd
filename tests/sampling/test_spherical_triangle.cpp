#include "pathscope/sampling/spherical_triangle.hpp"

#include <array>

#include "pathscope/math/random.hpp"
#include "statistics.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr int k_samples = k_sanitized ? 30'000 : 300'000;
constexpr double k_pi64 = std::numbers::pi;

Vec2 next_2d(HashRng& rng) {
    const float x = rng.next_float();
    return {x, rng.next_float()};
}

using Triple = std::array<double, 3>;

Triple from_origin(Vec3 v) { return {v.x, v.y, v.z}; }
double dot(const Triple& a, const Triple& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Triple& a) { return std::sqrt(dot(a, a)); }

/// The solid angle by libm, seen from the origin.
double solid_angle_of(const Triple& a, const Triple& b, const Triple& c) {
    const double volume = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                          a[2] * (b[0] * c[1] - b[1] * c[0]);
    const double la = length(a), lb = length(b), lc = length(c);
    return 2 * std::atan2(std::abs(volume), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
}

struct Corners {
    Vec3 a, b, c;
    [[nodiscard]] Triple point(double b1, double b2) const {
        Triple p{};
        for (int axis = 0; axis < 3; ++axis)
            p[std::size_t(axis)] = (1 - b1 - b2) * a[axis] + b1 * b[axis] + b2 * c[axis];
        return p;
    }
};

/// Ordinary, large, seen from 1/1000 of its size, from beside its plane, thin, and small and far.
constexpr Corners k_triangles[] = {
    {{1, 0.2f, 0.1f}, {0.1f, 1.5f, 0.3f}, {-0.4f, 0.2f, 1}},
    {{-9, -1, 1}, {8, -2, 1}, {1, 9, 1}},
    {{-0.5f, -0.4f, 1e-3f}, {0.5f, -0.3f, 1e-3f}, {0, 0.6f, 1e-3f}},
    {{0.1f, -0.5f, 0.01f}, {0.1f, 0.5f, 0.01f}, {1, 0, 0.01f}},
    {{-5, 0, 0.2f}, {5, 0, 0.2f}, {0, 0.01f, 0.2f}},
    {{10, 0, 0}, {10, 0.1f, 0}, {10, 0, 0.1f}},
};

SphericalTriangle see(const Corners& t) { return see_triangle({0, 0, 0}, t.a, t.b, t.c); }

}  // namespace

TEST_CASE("turns_of gives the angle back to 4e-7 of itself, near the axes too") {
    double worst = 0;
    for (const double scale : {1.0, 1e-3, 1e-6})
        for (int i = 1; i < 1 << 16; ++i) {
            const double turns = 0.5 * scale * i / (1 << 16), angle = 2 * k_pi64 * turns;
            const float x = float(3 * std::cos(angle)), y = float(3 * std::sin(angle));
            const double exact = std::atan2(double(y), double(x)) / (2 * k_pi64);
            worst = std::max(worst, std::abs(turns_of({x, y}) / exact - 1));
        }
    CHECK(worst < 4e-7);
    CHECK(turns_of({2, 0}) == 0);
    CHECK(turns_of({0, 2}) == 0.25f);
    CHECK(turns_of({-2, 0}) == 0.5f);
}

TEST_CASE("solid angles by hand: an octant, half a face of a cube, and nothing in one's own plane") {
    const float octant = see({{1, 0, 0}, {0, 7, 0}, {0, 0, 0.2f}}).solid_angle();
    CHECK(octant == doctest::Approx(k_pi64 / 2).epsilon(1e-6));
    const float half_face = see({{1, 1, 1}, {-1, 1, 1}, {-1, -1, 1}}).solid_angle();
    CHECK(half_face == doctest::Approx(k_pi64 / 3).epsilon(1e-6));
    CHECK(see({{1, 0, 0}, {0, 1, 0}, {3, 3, 0}}).solid_angle() == 0);
    // From within it, the plane of a triangle has no side.
    CHECK(see({{1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}}).solid_angle() == doctest::Approx(2 * k_pi64));
    for (const Corners& t : k_triangles)
        CHECK(see(t).solid_angle() ==
              doctest::Approx(solid_angle_of(from_origin(t.a), from_origin(t.b), from_origin(t.c)))
                  .epsilon(1e-6));
}

TEST_CASE("in an octant, directions have the density 2/pi (chi-square), whichever corner comes first") {
    const Vec3 x{2, 0, 0}, y{0, 0.3f, 0}, z{0, 0, 1};
    for (const Corners& t : {Corners{x, y, z}, Corners{y, z, x}, Corners{z, y, x}}) {
        const SphericalTriangle seen = see(t);
        HashRng rng(1);
        const SphereTest test = chi_square_sphere(
            [&](int) -> std::optional<Vec3> {
                const Vec2 weights = sample_spherical_triangle(seen, next_2d(rng));
                const Triple p = t.point(weights.x, weights.y);
                const double size = length(p);
                return Vec3{float(p[0] / size), float(p[1] / size), float(p[2] / size)};
            },
            [&](Vec3 w) { return min_component(w) >= 0 ? sample_spherical_triangle_pdf(seen) : 0.0f; },
            k_samples);
        CHECK(test.p_value > sidak_threshold(k_significance, 3));
        CHECK(test.pdf_integral == doctest::Approx(1).epsilon(1e-6));
    }
}

TEST_CASE("each part of a triangle is drawn in proportion to its solid angle (chi-square over 8 x 8 parts)") {
    const int side = 8;
    for (const Corners& t : k_triangles) {
        CAPTURE(see(t).solid_angle());
        HashRng rng(2);
        const SphericalTriangle seen = see(t);
        std::vector<double> observed(2 * side * side), expected(observed.size());
        for (int i = 0; i < k_samples; ++i) {
            const Vec2 weights = sample_spherical_triangle(seen, next_2d(rng));
            REQUIRE(weights.x >= 0);
            REQUIRE(weights.y >= 0);
            REQUIRE(weights.x + weights.y <= 1 + 1e-6f);
            const float x = weights.x * side, y = weights.y * side;
            const int column = std::min(int(x), side - 1), row = std::min(int(y), side - 1 - column);
            const bool upper = column + row < side - 1 && x - float(column) + y - float(row) > 1;
            ++observed[std::size_t(2 * (row * side + column) + upper)];
        }
        double total = 0;
        for (int row = 0; row < side; ++row)
            for (int column = 0; column + row < side; ++column) {
                const auto at = [&](int c, int r) { return t.point(double(c) / side, double(r) / side); };
                const auto place = std::size_t(2 * (row * side + column));
                expected[place] = solid_angle_of(at(column, row), at(column + 1, row), at(column, row + 1));
                if (column + row < side - 1)
                    expected[place + 1] =
                        solid_angle_of(at(column + 1, row + 1), at(column + 1, row), at(column, row + 1));
                total += expected[place] + expected[place + 1];
            }
        CHECK(total * sample_spherical_triangle_pdf(seen) == doctest::Approx(1).epsilon(1e-6));
        for (double& cell : expected) cell *= k_samples / total;
        CHECK(chi_square_test(observed, expected).p_value >
              sidak_threshold(k_significance, int(std::size(k_triangles))));
    }
}

TEST_CASE("the corners of the square lead to the corners of the triangle") {
    constexpr float k_end = k_one_minus_epsilon;
    const Corners& t = k_triangles[0];
    const SphericalTriangle seen = see(t);
    const auto is_at = [&](Vec2 u, Vec2 weights) {
        const Vec2 found = sample_spherical_triangle(seen, u);
        return std::abs(found.x - weights.x) < 1e-5f && std::abs(found.y - weights.y) < 1e-5f;
    };
    CHECK(is_at({0, 0}, {1, 0}));
    CHECK(is_at({k_end, 0}, {1, 0}));
    CHECK(is_at({0, k_end}, {0, 0}));
    CHECK(is_at({k_end, k_end}, {0, 1}));
}
