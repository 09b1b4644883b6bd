#include "pathscope/math/simd.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

// The versions for AVX are compared with this one, bit by bit, by the users of the header (tests/bvh/test_wide.cpp).

TEST_CASE("names of levels can be read back, and the level in use is one that the machine has") {
    for (const auto& entry : k_simd_level_names)
        CHECK(from_name<SimdLevel>(name_of(entry.value)) == entry.value);
    CHECK(simd_level() <= highest_simd_level());
}

TEST_CASE("lanes are walked from the lowest") {
    Lanes lanes = 0b10010100;
    for (const int expected : {2, 4, 7}) {
        REQUIRE(any(lanes));
        CHECK(first(lanes) == expected);
        lanes = without_first(lanes);
    }
    CHECK_FALSE(any(lanes));
}

TEST_CASE("arithmetic is that of single floats, lane by lane") {
    HashRng rng(3);
    for (int round = 0; round < 1000; ++round) {
        alignas(32) std::array<float, 8> a, b, sum, product, ratio, fused_sum;
        for (std::size_t i = 0; i < 8; ++i) a[i] = rng.next_float() - 0.5f, b[i] = rng.next_float() - 0.5f;
        const Float8 x = load(a.data()), y = load(b.data());
        store(sum.data(), x + y);
        store(product.data(), x * y - y);
        store(ratio.data(), x / y);
        store(fused_sum.data(), fused(x, y, x));
        CHECK(least(x) == *std::min_element(a.begin(), a.end()));
        CHECK(greatest(x) == *std::max_element(a.begin(), a.end()));
        const Lanes at_most_lanes = at_most(x, y);
        for (std::size_t i = 0; i < 8; ++i) {
            CHECK(sum[i] == a[i] + b[i]);
            CHECK(product[i] == a[i] * b[i] - b[i]);
            CHECK(ratio[i] == a[i] / b[i]);
            CHECK(fused_sum[i] == std::fma(a[i], b[i], a[i]));
            CHECK((at_most_lanes >> i & 1) == (a[i] <= b[i]));
        }
    }
}

TEST_CASE("sixteen floats are sixteen single ones") {
    HashRng rng(4);
    for (int round = 0; round < 1000; ++round) {
        alignas(64) std::array<float, 16> a, b, ratio, chosen, least_of, greatest_of, about, fused_sum, size;
        for (std::size_t i = 0; i < 16; ++i) a[i] = rng.next_float() - 0.5f, b[i] = rng.next_float() - 0.5f;
        const Float16 x = load16(a.data()), y = load16(b.data());
        const Lanes lanes = rng.next_u32() & 0xffff;
        store(ratio.data(), (x + y) / (x - broadcast16(2)));
        store(chosen.data(), select(lanes, x, y));
        store(least_of.data(), min(x, y));
        store(greatest_of.data(), max(x, y));
        store(about.data(), about_multiply_add(x, y, x));
        store(fused_sum.data(), fused(x, y, x));
        store(size.data(), magnitude(x));
        CHECK(least(x) == *std::min_element(a.begin(), a.end()));
        CHECK(greatest(x) == *std::max_element(a.begin(), a.end()));
        const Lanes at_most_lanes = at_most(x, y);
        for (std::size_t i = 0; i < 16; ++i) {
            CHECK(size[i] == std::abs(a[i]));
            CHECK(ratio[i] == (a[i] + b[i]) / (a[i] - 2));
            CHECK(chosen[i] == ((lanes >> i & 1) != 0 ? a[i] : b[i]));
            CHECK(least_of[i] == std::min(a[i], b[i]));
            CHECK(greatest_of[i] == std::max(a[i], b[i]));
            CHECK((at_most_lanes >> i & 1) == (a[i] <= b[i]));
            CHECK(fused_sum[i] == std::fma(a[i], b[i], a[i]));
            const double product = double(a[i]) * double(b[i]), exact = product + double(a[i]);
            CHECK(std::abs(about[i] - exact) <= 0x1.01p-24 * (std::abs(product) + std::abs(exact)));
        }
    }
}

TEST_CASE("eight times eight floats, turned over the diagonal") {
    std::array<Float8, 8> rows;
    for (int i = 0; i < 8; ++i) {
        alignas(32) std::array<float, 8> row;
        for (int j = 0; j < 8; ++j) row[std::size_t(j)] = float(8 * i + j);
        rows[std::size_t(i)] = load(row.data());
    }
    const std::array<Float8, 8> columns = transposed(rows);
    for (int j = 0; j < 8; ++j) {
        alignas(32) std::array<float, 8> column;
        store(column.data(), columns[std::size_t(j)]);
        for (int i = 0; i < 8; ++i) CHECK(column[std::size_t(i)] == float(8 * i + j));
    }
}

TEST_CASE("comparisons with NaN are false; of NaN and a number, min and max return the second") {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    CHECK(at_most(broadcast(nan), broadcast(1.0f)) == 0);
    CHECK(at_most(broadcast(1.0f), broadcast(nan)) == 0);
    alignas(32) std::array<float, 8> out;
    store(out.data(), min(broadcast(nan), broadcast(2.0f)));
    CHECK(out[5] == 2);
    store(out.data(), max(broadcast(2.0f), broadcast(nan)));
    CHECK(std::isnan(out[5]));
}
