#include "../../src/filter/portable_log.hpp"

#include <cmath>
#include <limits>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

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

TEST_CASE("portable_log has no step where the exponent changes") {
    const float root_half = std::sqrt(0.5f);
    for (const float z : {root_half, 2 * root_half, 1.0f, 2.0f, 4 * root_half}) {
        const float below = std::nextafter(z, 0.0f), above = std::nextafter(z, 10.0f);
        CHECK(portable_log(below) == doctest::Approx(std::log(double(below))).epsilon(1.2e-7));
        CHECK(portable_log(below) < portable_log(above));
    }
}
