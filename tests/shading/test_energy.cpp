// White furnaces: what comes back of light that arrives from everywhere.
#include "pathscope/shading/albedo.hpp"
#include "pathscope/shading/albedo_table.hpp"
#include "statistics.hpp"
#include "surfaces.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

TEST_CASE("furnaces with an answer on paper") {
    // Lambert: its albedo.
    CHECK(directional_albedo({Lambert{{0.8f, 0.5f, 0.1f}}}, direction_at(0.3f)).y ==
          doctest::Approx(0.5).epsilon(1e-4));
    for (const float cosine : {1.0f, 0.5f, 0.2f}) {
        // Metal of roughness 1: D = 1/pi and V = 1 / (2 (co + ci)), so E = 1 - co ln((1 + co) / co).
        const Rgb metal = directional_albedo(standard({}, {1, 1, 1}, 1), direction_at(cosine));
        CHECK(metal.x == doctest::Approx(1 - cosine * std::log((1 + cosine) / cosine)).epsilon(2e-4));
        // Base of roughness 0, no coat: E = (1 - (1 - co)^5) * 20/21.
        const Rgb base = directional_albedo(standard({0.5f, 0.5f, 0.5f}, {}, 0), direction_at(cosine));
        CHECK(base.x == doctest::Approx(0.5 * (1 - std::pow(1 - cosine, 5)) * 20 / 21).epsilon(2e-4));
    }
}

TEST_CASE("energy: no direction sends back more than arrives, on a grid of roughness, base, f0 and angle") {
    double largest = 0;
    for (const float roughness :
         {0.0f, 0.03f, 0.045f, 0.07f, 0.1f, 0.15f, 0.25f, 0.4f, 0.6f, 0.8f, 0.95f, 1.0f})
        for (const float f0 : {0.0f, 0.01f, 0.04f, 0.2f, 0.6f, 1.0f})
            for (const float cosine : {1.0f, 0.7f, 0.4f, 0.2f, 0.1f, 0.05f, 0.02f, 0.005f}) {
                // Three bases at once, one in each channel: none, half and all; with f0 = 1, a sum of 2.
                const Bsdf bsdf = standard({0, 0.5f, 1}, {f0, f0, f0}, roughness);
                const Rgb albedo = directional_albedo(bsdf, direction_at(cosine), 96);
                largest = std::max(largest, double(max_component(albedo)));
                CAPTURE(roughness);
                CAPTURE(f0);
                CAPTURE(cosine);
                CHECK(max_component(albedo) <= 1.001f);
                CHECK(albedo.x <= albedo.y);
                CHECK(albedo.y <= albedo.z);
            }
    // Not by being dark: the whitest surface, a smooth metal, loses nothing.
    CHECK(largest > 0.999);
}

TEST_CASE("energy: coloured metals and colours whose sum is above 1 in one channel only") {
    for (const float roughness : {0.05f, 0.3f, 0.7f, 1.0f})
        for (const float cosine : {1.0f, 0.3f, 0.05f}) {
            const Bsdf bsdf = standard({0.9f, 0.5f, 1}, {0.8f, 0.02f, 0}, roughness);
            CHECK(max_component(directional_albedo(bsdf, direction_at(cosine), 96)) <= 1.001f);
        }
}

TEST_CASE("the table of lobe albedos agrees with brute force to 0.012, and mostly to 0.003") {
    Moments error;
    double worst = 0;
    for (const float roughness : {0.0f, 0.05f, 0.12f, 0.3f, 0.55f, 0.77f, 1.0f})
        for (const float cosine : {1.0f, 0.8f, 0.45f, 0.21f, 0.07f, 0.01f}) {
            const Vec3 outgoing = direction_at(cosine);
            const LobeAlbedos table = AlbedoRow(roughness).at(cosine);
            // f90 = 1 for the first, so E = f0 * scale + bias; without f0 there is no coat.
            const float f0 = 0.1f;
            const float coat = directional_albedo(standard({}, {f0, f0, f0}, roughness), outgoing, 200).x;
            const float base =
                directional_albedo(standard({0.5f, 0.5f, 0.5f}, {}, roughness), outgoing, 64).x / 0.5f;
            for (const double difference : {coat - (f0 * table.scale + table.bias), base - table.diffuse}) {
                error.add(std::abs(difference));
                worst = std::max(worst, std::abs(difference));
            }
        }
    CAPTURE(worst);
    CAPTURE(error.mean());
    CHECK(worst < 0.012);
    CHECK(error.mean() < 0.003);
}

TEST_CASE("guide_albedo is the directional albedo to 0.025") {
    for (const Bsdf& bsdf : smooth_surfaces())
        for (const float cosine : {1.0f, 0.5f, 0.1f}) {
            const Rgb guide = guide_albedo(bsdf, direction_at(cosine));
            const Rgb exact = directional_albedo(bsdf, direction_at(cosine), 128);
            CAPTURE(cosine);
            CHECK(max_component(abs(guide - exact)) < 0.025f);
        }
}

TEST_CASE("what the standard material loses in a white furnace, because facets catch no second bounce") {
    // 1 - E of a white metal (f0 = 1) and of a white base under f0 = 0.04, by roughness and cosine of the
    // view. The last row is on paper: cosine * ln((1 + cosine) / cosine).
    struct Row {
        float roughness;
        float metal[3];  // cosine 1, 0.5, 0.1
        float plastic[3];
    };
    const Row stated[] = {
        {0.2f, {0.0017f, 0.0045f, 0.0710f}, {0.0591f, 0.0471f, 0.0096f}},
        {0.4f, {0.0323f, 0.0736f, 0.1117f}, {0.1087f, 0.0917f, 0.0966f}},
        {0.6f, {0.1755f, 0.2179f, 0.1176f}, {0.1677f, 0.1546f, 0.1059f}},
        {0.8f, {0.4448f, 0.3788f, 0.1669f}, {0.2340f, 0.2173f, 0.0706f}},
        {1.0f, {0.6931f, 0.5493f, 0.2398f}, {0.3020f, 0.2794f, 0.0330f}},
    };
    const float cosines[] = {1.0f, 0.5f, 0.1f};
    for (const Row& row : stated)
        for (int i = 0; i < 3; ++i) {
            const Vec3 outgoing = direction_at(cosines[i]);
            const float metal = 1 - directional_albedo(standard({}, {1, 1, 1}, row.roughness), outgoing).x;
            const float plastic =
                1 - directional_albedo(standard({1, 1, 1}, {0.04f, 0.04f, 0.04f}, row.roughness), outgoing).x;
            CHECK(std::abs(metal - row.metal[i]) < 0.0005f);
            CHECK(std::abs(plastic - row.plastic[i]) < 0.0005f);
        }
}
