#include "pathscope/math/fused.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "pathscope/math/random.hpp"
#include "pathscope/math/simd.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

constexpr float k_inf = std::numeric_limits<float>::infinity();

/// The result, from the header's arithmetic and from a register's first lane, which have to agree.
float fused_both_ways(float a, float b, float c) {
    std::array<float, k_floats> lanes;
    store_floats(lanes.data(), fused(broadcast_floats(a), broadcast_floats(b), broadcast_floats(c)));
    const float alone = fused_multiply_add(a, b, c);
    CHECK(std::bit_cast<std::uint32_t>(lanes[0]) == std::bit_cast<std::uint32_t>(alone));
    return alone;
}

}  // namespace

TEST_CASE(
    "fused_multiply_add is the C library's fma, for numbers of all sizes that nearly cancel and that do "
    "not") {
    HashRng rng(1);
    const auto any_float = [&](int largest_exponent) {
        const int exponent = int(float(2 * largest_exponent) * rng.next_float()) - largest_exponent;
        return std::ldexp(2 * rng.next_float() - 1, exponent);
    };
    int differs_from_two_roundings = 0;
    for (int i = 0; i < 300'000; ++i) {
        const float a = any_float(60), b = any_float(60);
        const std::array addends{any_float(120), -a * b, a * b * std::ldexp(1.0f, i % 60 - 30), 0.0f};
        for (const float c : addends) {
            const float expected = std::fma(a, b, c);
            CHECK(fused_both_ways(a, b, c) == expected);
            differs_from_two_roundings += a * b + c != expected;
        }
    }
    CHECK(differs_from_two_roundings > 100'000);
}

TEST_CASE("a sum next to the middle between two floats is rounded to the side that it is on") {
    // 2^-24, half a step, is the middle between 1 and the next float, and (1 + 2^-23)(1 - 2^-23) = 1 - 2^-46 lies below 1
    // by so little that a double near 1 does not show it. Middles are rounded to the even neighbour, which here is wrong.
    const float half_step = 0x1p-24f, next = 1 + 0x1p-23f, after_next = 1 + 0x1p-22f;
    for (const float sign : {1.0f, -1.0f}) {
        const float less_than_half = sign * half_step * (1 + 0x1p-23f), factor = 1 - 0x1p-23f;
        CHECK(sign * next + less_than_half * factor == sign * after_next);
        CHECK(fused_both_ways(less_than_half, factor, sign * next) == sign * next);
        CHECK(sign * next - less_than_half * factor == sign * 1.0f);
        CHECK(fused_both_ways(-less_than_half, factor, sign * next) == sign * next);
    }
}

TEST_CASE("what is infinite or not a number stays so") {
    CHECK(fused_both_ways(k_inf, 1, 1) == k_inf);
    CHECK(fused_both_ways(k_inf, -1, 1) == -k_inf);
    CHECK(fused_both_ways(1, 1, k_inf) == k_inf);
    CHECK(fused_both_ways(3e38f, 3e38f, 0) == k_inf);
    CHECK(std::isnan(fused_both_ways(k_inf, 1, -k_inf)));
    CHECK(std::isnan(fused_both_ways(0, k_inf, 1)));
    CHECK(std::isnan(fused_both_ways(std::numeric_limits<float>::quiet_NaN(), 1, 1)));
}
