#include "pathscope/shading/fresnel.hpp"

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("dielectric at normal incidence: ((eta - 1) / (eta + 1))^2, from either side") {
    CHECK(fresnel_dielectric(1, 1.5f) == doctest::Approx(0.04));
    CHECK(fresnel_dielectric(1, 1 / 1.5f) == doctest::Approx(0.04));
    CHECK(fresnel_dielectric(1, 1.33f) == doctest::Approx(0.33 * 0.33 / (2.33 * 2.33)));
    CHECK(fresnel_dielectric(0.3f, 1) == doctest::Approx(0));
}

TEST_CASE("dielectric at Brewster's angle, tan = eta: only the other polarisation is reflected") {
    const double eta = 1.5, cosine = 1 / std::sqrt(1 + eta * eta);
    // There r_p = 0 and r_s = (1 - eta^2) / (1 + eta^2).
    const double r_s = (1 - eta * eta) / (1 + eta * eta);
    CHECK(fresnel_dielectric(float(cosine), float(eta)) == doctest::Approx(0.5 * r_s * r_s).epsilon(1e-5));
}

TEST_CASE("dielectric: all is reflected at grazing angles and, inside, beyond the critical angle") {
    CHECK(fresnel_dielectric(0, 1.5f) == doctest::Approx(1));
    const float critical_cosine = std::sqrt(1 - 1 / (1.5f * 1.5f));
    CHECK(fresnel_dielectric(critical_cosine - 0.001f, 1 / 1.5f) == 1);
    CHECK(fresnel_dielectric(critical_cosine + 0.001f, 1 / 1.5f) < 0.9f);
}

TEST_CASE("dielectric: the same from both sides of the boundary along one ray (Stokes)") {
    for (const float eta : {1.1f, 1.33f, 1.5f, 2.4f})
        for (float cosine = 0.05f; cosine < 1; cosine += 0.05f) {
            const float far = refracted_cosine(cosine, eta);
            CHECK(fresnel_dielectric(far, 1 / eta) ==
                  doctest::Approx(fresnel_dielectric(cosine, eta)).epsilon(1e-4));
        }
}

TEST_CASE("Schlick: f0 at normal, f90 at grazing incidence, and within 0.04 of glass between") {
    CHECK(fresnel_schlick(0.04f, 1, 1) == 0.04f);
    CHECK(fresnel_schlick(0.04f, 0.7f, 0) == doctest::Approx(0.7));
    CHECK(fresnel_schlick(Rgb{0, 0.5f, 1}, 1, 0.5f).y == doctest::Approx(0.5 + 0.5 / 32));
    for (float cosine = 0; cosine <= 1; cosine += 0.01f)
        CHECK(std::abs(fresnel_schlick(0.04f, 1, cosine) - fresnel_dielectric(cosine, 1.5f)) < 0.04f);
}

TEST_CASE("a pane's reflectance is the sum over all bounces between its boundaries") {
    for (const double r : {0.0, 0.04, 0.3, 0.9, 1.0}) {
        double sum = r, inside = (1 - r) * (1 - r) * r;
        for (int bounce = 0; bounce < 2000; ++bounce, inside *= r * r) sum += inside;
        CHECK(pane_reflectance(float(r)) == doctest::Approx(sum).epsilon(1e-5));
    }
}
