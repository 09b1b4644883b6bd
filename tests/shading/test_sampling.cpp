// Every way to draw a direction against the density it claims, and against the light it should carry.
#include <utility>

#include "pathscope/shading/albedo.hpp"
#include "pathscope/shading/bsdf.hpp"
#include "statistics.hpp"
#include "surfaces.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr float k_cosines[] = {1.0f, 0.5f, 0.1f};

std::vector<Bsdf> tested_surfaces() {
    std::vector<Bsdf> surfaces = smooth_surfaces();
    for (const float roughness : {0.15f, 0.4f, 0.7f, 1.0f})
        surfaces.push_back(standard({0.5f, 0.5f, 0.5f}, {0.3f, 0.3f, 0.3f}, roughness));
    surfaces.push_back({Lambert{{0.5f, 0.5f, 0.5f}}, 0.6f});
    surfaces.push_back({StandardSurface{{0.5f, 0.5f, 0.5f}, {0.3f, 0.3f, 0.3f}, 0.4f}, 0.6f});
    return surfaces;
}

std::string label(const Bsdf& bsdf, HemisphereSampling lever, float cosine) {
    std::string text = std::string(name_of(bsdf_kind(bsdf))) + ", " + std::string(name_of(lever));
    if (const auto* surface = std::get_if<StandardSurface>(&bsdf.surface))
        text += ", roughness " + std::to_string(surface->roughness);
    return text + ", opacity " + std::to_string(bsdf.opacity) + ", cosine " + std::to_string(cosine);
}

}  // namespace

TEST_CASE("sampled directions have the density they say; what passes straight or is lost is the rest of 1") {
    const int samples = k_sanitized ? 10'000 : 100'000;
    const std::vector<Bsdf> surfaces = tested_surfaces();
    const double threshold = sidak_threshold(k_significance, int(surfaces.size()) * 3 * 3);
    std::uint32_t seed = 100;
    for (const Bsdf& bsdf : surfaces)
        for (const auto& [lever, name] : k_hemisphere_names)
            for (const float cosine : k_cosines) {
                // The other levers do not look at the surface: with and without opacity is all there is.
                if (lever != HemisphereSampling::bsdf && bsdf.opacity == 1 && &bsdf != &surfaces[1]) continue;
                const Vec3 outgoing = direction_at(cosine);
                HashRng rng(++seed);
                const auto sample = [&, lever = lever](int) -> std::optional<Vec3> {
                    const float u_lobe = rng.next_float();
                    const auto drawn = sample_direction(lever, bsdf, outgoing, u_lobe, next_2d(rng));
                    if (!drawn || drawn->specular) return std::nullopt;
                    return drawn->incoming;
                };
                const auto pdf = [&, lever = lever](Vec3 incoming) {
                    return sample_direction_pdf(lever, bsdf, outgoing, incoming);
                };
                const SphereTest test = chi_square_sphere(sample, pdf, samples, 16, 32);
                CAPTURE(label(bsdf, lever, cosine));
                CHECK(test.p_value > threshold);
                CHECK(test.pdf_integral < bsdf.opacity + 1e-3);
                if (lever != HemisphereSampling::bsdf)
                    CHECK(test.pdf_integral == doctest::Approx(bsdf.opacity).epsilon(1e-4));
            }
}

TEST_CASE("the mean weight is the directional albedo, under every lever: within 4 standard errors") {
    const int samples = k_sanitized ? 4'000 : 40'000;
    std::uint32_t seed = 1000;
    for (const Bsdf& bsdf : tested_surfaces())
        for (const float cosine : k_cosines) {
            const Vec3 outgoing = direction_at(cosine);
            const Rgb albedo = directional_albedo(bsdf, outgoing, 200);
            for (const auto& [lever, name] : k_hemisphere_names) {
                // So few blind samples rarely meet a narrow lobe; their error is not normal then.
                const auto* glossy = std::get_if<StandardSurface>(&bsdf.surface);
                if (lever != HemisphereSampling::bsdf && glossy && glossy->roughness < 0.35f) continue;
                HashRng rng(++seed);
                Moments channels[3];
                for (int i = 0; i < samples; ++i) {
                    const float u_lobe = rng.next_float();
                    const auto drawn = sample_direction(lever, bsdf, outgoing, u_lobe, next_2d(rng));
                    const Rgb weight = drawn && !drawn->specular ? drawn->weight : Rgb{};
                    for (int c = 0; c < 3; ++c) channels[c].add(weight[c]);
                }
                CAPTURE(label(bsdf, lever, cosine));
                for (int c = 0; c < 3; ++c) {
                    CAPTURE(albedo[c]);
                    CAPTURE(channels[c].mean());
                    CAPTURE(channels[c].standard_error());
                    // 2e-4 is the quadrature's own error, relative.
                    CHECK(std::abs(channels[c].mean() - albedo[c]) <=
                          4 * channels[c].standard_error() + 2e-4 * albedo[c]);
                }
            }
        }
}
