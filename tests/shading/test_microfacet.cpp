#include "pathscope/shading/microfacet.hpp"

#include "pathscope/math/random.hpp"
#include "statistics.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr double k_full_turn = 2 * std::numbers::pi;

Vec3 direction_at(float cosine) {
    return {std::sqrt(1 - cosine * cosine) * 0.8f, std::sqrt(1 - cosine * cosine) * 0.6f, cosine};
}

/// Smith's masking of one direction: 1 / (1 + Lambda).
double smith_masking(double cosine, double alpha) {
    const double tan2 = (1 - cosine * cosine) / (cosine * cosine);
    return 2 / (1 + std::sqrt(1 + alpha * alpha * tan2));
}

}  // namespace

TEST_CASE("the facets of a unit of surface cover a unit: D cos integrates to 1") {
    for (const float alpha : {0.02f, 0.1f, 0.5f, 1.0f}) {
        const auto projected = [&](Vec3 h) { return double(ggx_distribution(h, alpha)) * h.z; };
        // Most of it lies close to the pole: in two parts.
        CHECK(integrate_sphere_patch(projected, 0, 0.99, 0, k_full_turn, 1e-6) +
                  integrate_sphere_patch(projected, 0.99, 1, 0, k_full_turn, 1e-6, 3) ==
              doctest::Approx(1).epsilon(1e-4));
    }
}

TEST_CASE("the facets seen from a direction cover what is seen: D G1 max(0, wo.h) integrates to cos_o") {
    for (const float alpha : {0.1f, 0.5f, 1.0f})
        for (const float cosine : {1.0f, 0.6f, 0.1f}) {
            const Vec3 outgoing = direction_at(cosine);
            const auto visible = [&](Vec3 h) {
                return smith_masking(cosine, alpha) * ggx_distribution(h, alpha) *
                       std::max(0.0f, dot(outgoing, h));
            };
            CHECK(integrate_sphere_patch(visible, 0, 1, 0, k_full_turn, 1e-6, 4) ==
                  doctest::Approx(cosine).epsilon(1e-3));
        }
}

TEST_CASE("visibility is Smith's height-correlated G over 4 cos cos, in its textbook form") {
    const auto lambda = [](double cosine, double alpha) { return 1 / smith_masking(cosine, alpha) - 1; };
    for (const float alpha : {0.01f, 0.3f, 1.0f})
        for (const float out : {0.05f, 0.5f, 1.0f})
            for (const float in : {0.02f, 0.7f, 1.0f}) {
                const double g = 1 / (1 + lambda(out, alpha) + lambda(in, alpha));
                CHECK(ggx_visibility(direction_at(out), direction_at(in), alpha) ==
                      doctest::Approx(g / (4 * out * in)).epsilon(1e-4));
            }
}

TEST_CASE(
    "reflections about visible normals have the density they say, and lose what it lacks (chi-square)") {
    const float alphas[] = {0.05f, 0.1f, 0.3f, 0.7f, 1.0f}, cosines[] = {1.0f, 0.7f, 0.3f, 0.05f};
    const int samples = k_sanitized ? 20'000 : 100'000;
    std::uint32_t seed = 10;
    for (const float alpha : alphas)
        for (const float cosine : cosines) {
            const Vec3 outgoing = direction_at(cosine);
            HashRng rng(++seed);
            const auto sample = [&](int) -> std::optional<Vec3> {
                const float x = rng.next_float();
                const Vec3 incoming = sample_ggx_reflection(outgoing, alpha, {x, rng.next_float()});
                if (incoming.z <= 0) return std::nullopt;
                return incoming;
            };
            const auto pdf = [&](Vec3 incoming) {
                if (incoming.z <= 0) return 0.0f;
                return sample_ggx_reflection_pdf(outgoing, normalize(outgoing + incoming), alpha);
            };
            const SphereTest test = chi_square_sphere(sample, pdf, samples, 16, 32, alpha < 0.1f ? 3 : 1);
            CAPTURE(alpha);
            CAPTURE(cosine);
            CHECK(test.p_value > sidak_threshold(k_significance, 20));
            CHECK(test.pdf_integral < 1.0001);
            CHECK(test.rejected < samples / 4);
        }
}

TEST_CASE(
    "samples are finite at the corners of the square, for the smoothest surface and the flattest view") {
    for (const float alpha : {k_min_alpha, 0.5f, 1.0f})
        for (const float cosine : {1e-7f, 1e-3f, 1.0f})
            for (const float x : {0.0f, 0.5f, k_one_minus_epsilon})
                for (const float y : {0.0f, 0.5f, k_one_minus_epsilon}) {
                    const Vec3 incoming = sample_ggx_reflection(direction_at(cosine), alpha, {x, y});
                    CHECK(is_finite(incoming));
                    CHECK(length(incoming) == doctest::Approx(1).epsilon(1e-5));
                }
}
