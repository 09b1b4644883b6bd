#include "../../src/filter/exp_log.hpp"

#include <limits>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("exp_negative is exp(-d) to a few last bits, and exactly 1 at 0") {
    double worst = 0;
    for (int i = 0; i < 200'000; ++i) {
        const float d = float(i) * (80.0f / 200'000);
        worst = std::max(worst, std::abs(double(exp_negative(d)) / std::exp(-double(d)) - 1));
    }
    CHECK(worst < 3e-7);
    CHECK(worst > 0);
    CHECK(exp_negative(0) == 1);
    CHECK(exp_negative(1e-30f) == 1);
}

TEST_CASE("exp_negative is 0 beyond its range and for NaN") {
    const float inf = std::numeric_limits<float>::infinity();
    for (const float d : {k_exp_cutoff, 81.0f, 1e3f, 1e18f, std::numeric_limits<float>::max(), inf,
                          std::numeric_limits<float>::quiet_NaN()})
        CHECK(exp_negative(d) == 0);
}

TEST_CASE("portable_log is ln(z), rounded") {
    HashRng rng(1);
    for (int i = 0; i < 100'000; ++i) {
        const float z = std::exp(170 * rng.next_float() - 85);
        CHECK(portable_log(z) == doctest::Approx(std::log(double(z))).epsilon(1.2e-7));
    }
    CHECK(portable_log(1) == 0);
    CHECK(portable_log(std::numeric_limits<float>::denorm_min()) == doctest::Approx(-103.27893));
    CHECK(portable_log(std::numeric_limits<float>::max()) == doctest::Approx(88.72284));
}
