#include "../../src/filter/exp2_negative.hpp"

#include <array>
#include <cmath>
#include <limits>

#include "testing.hpp"

using namespace pathscope;

namespace {

float one_exp2_negative(float d) {
    std::array<float, k_floats> out;
    store_floats(out.data(), exp2_negative(broadcast_floats(d)));
    for (const float lane : out) CHECK(lane == out[0]);
    return out[0];
}

}  // namespace

TEST_CASE("exp2_negative is 2^-d to a few last bits, and exactly so where d is whole") {
    constexpr int k_steps = 200'000;
    double worst = 0;
    for (int i = 0; i < k_steps; ++i) {
        const float d = float(i) * (126.0f / k_steps);
        worst = std::max(worst, std::abs(double(one_exp2_negative(d)) / std::exp2(-double(d)) - 1));
    }
    CHECK(worst < 4e-7);
    CHECK(worst > 0);
    for (int d = 0; d <= 126; ++d) CHECK(one_exp2_negative(float(d)) == std::ldexp(1.0f, -d));
    CHECK(one_exp2_negative(1e-30f) == 1);
}

TEST_CASE("exp2_negative is next to nothing, but not negative, where floats run out of bits") {
    for (float d = 126; d < 127; d += 1.0f / 1024) {
        CAPTURE(d);
        CHECK(one_exp2_negative(d) >= 0);
        CHECK(one_exp2_negative(d) <= std::ldexp(1.0f, -126));
    }
}

TEST_CASE("exp2_negative is 0 beyond its range and for NaN") {
    const float inf = std::numeric_limits<float>::infinity();
    for (const float d : {127.0f, 127.5f, 1e3f, 1e18f, std::numeric_limits<float>::max(), inf,
                          std::numeric_limits<float>::quiet_NaN()})
        CHECK(one_exp2_negative(d) == 0);
}
