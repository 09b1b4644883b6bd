#include <bit>
#include <cmath>

#include "pathscope/math/box.hpp"
#include "pathscope/math/frame.hpp"
#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {
Vec3 random_direction(HashRng& rng) {
    for (;;) {
        const Vec3 v{2 * rng.next_float() - 1, 2 * rng.next_float() - 1, 2 * rng.next_float() - 1};
        if (length_squared(v) <= 1 && length_squared(v) > 1e-4f) return normalize(v);
    }
}
}  // namespace

TEST_CASE("a frame is orthonormal, right-handed, and its two maps are inverse") {
    HashRng rng(1);
    for (int i = 0; i < 1000; ++i) {
        const Vec3 n = i == 0 ? Vec3{0, 0, -1} : random_direction(rng);
        const Frame frame = Frame::around(n);
        CHECK(std::abs(dot(frame.tangent, frame.bitangent)) < 1e-6f);
        CHECK(std::abs(dot(frame.tangent, n)) < 1e-6f);
        CHECK(length(cross(frame.tangent, frame.bitangent) - n) < 1e-6f);
        const Vec3 w = random_direction(rng);
        CHECK(length(frame.to_world(frame.to_local(w)) - w) < 1e-6f);
    }
}

TEST_CASE("reflect keeps the angle and swaps the side") {
    const Vec3 n{0, 0, 1};
    const Vec3 w = normalize(Vec3{1, 2, 3});
    CHECK(length(reflect(w, n) - normalize(Vec3{-1, -2, 3})) < 1e-6f);
}

TEST_CASE("a box grows by points and knows when it is empty") {
    Box box;
    CHECK(box.empty());
    CHECK(box.half_area() == 0);
    box.add(Vec3{1, 2, 3});
    CHECK_FALSE(box.empty());
    box.add(Vec3{3, 3, 4});
    CHECK(box.half_area() == 2 * 1 + 1 * 1 + 1 * 2);
    CHECK(box.longest_axis() == 0);
}

TEST_CASE("hash_u32: each input bit flips each output bit in half of all cases") {
    // 65,536 inputs: the count of flips is binomial with sigma = 128; 5.5 sigma over 1,024 pairs has p <
    // 1e-4.
    for (int in = 0; in < 32; ++in) {
        int flips[32] = {};
        for (std::uint32_t i = 0; i < 65536; ++i) {
            const std::uint32_t x = i * 0x9e3779b1u;
            const std::uint32_t change = hash_u32(x) ^ hash_u32(x ^ (1u << in));
            for (int out = 0; out < 32; ++out) flips[out] += (change >> out) & 1;
        }
        for (const int count : flips) CHECK(std::abs(count - 32768) < 704);
    }
}

TEST_CASE("HashRng is uniform in mean and variance, and never 1") {
    HashRng rng(7);
    double sum = 0, sum_of_squares = 0;
    const int n = 1 << 20;
    float largest = 0;
    for (int i = 0; i < n; ++i) {
        const float u = rng.next_float();
        sum += u;
        sum_of_squares += double(u) * u;
        largest = std::max(largest, u);
    }
    // Standard errors: 1/sqrt(12 n) for the mean, sqrt(4/45/n) for the mean square; 4 of each.
    CHECK(std::abs(sum / n - 0.5) < 4 * std::sqrt(1.0 / 12 / n));
    CHECK(std::abs(sum_of_squares / n - 1.0 / 3) < 4 * std::sqrt(4.0 / 45 / n));
    CHECK(largest < 1);
}
