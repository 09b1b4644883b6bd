#include "pathscope/image/exact_sum.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <vector>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

/// Radiance as path tracing makes it: many zeros, a body around 1, and a tail over five orders of magnitude.
std::vector<Rgb> random_samples(HashRng& rng, std::size_t count) {
    const auto channel = [&] {
        const float u = rng.next_float();
        return u < 0.3f ? 0.0f : std::exp(12 * rng.next_float() - 6) * rng.next_float();
    };
    std::vector<Rgb> samples(count);
    for (Rgb& sample : samples) sample = {channel(), channel(), channel()};
    return samples;
}

template <class Value>
void shuffle(std::vector<Value>& values, HashRng& rng) {
    for (std::size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[rng.next_u32() % i]);
}

/// Adds values up as servers and relays would: cut anywhere, parts summed alone, parts of parts joined.
template <class Sum>
Sum add_in_groups(std::vector<Sum> parts, HashRng& rng) {
    while (parts.size() > 1) {
        const std::size_t i = rng.next_u32() % (parts.size() - 1);
        parts[i] = parts[i] + parts[i + 1];
        parts.erase(parts.begin() + std::ptrdiff_t(i) + 1);
    }
    return parts[0];
}

PixelSum quantise_all(const std::vector<Rgb>& samples, Quantum quantum) {
    PixelSum sum;
    bool saturated = false;
    for (const Rgb sample : samples) sum += quantise(sample, quantum, saturated);
    CHECK_FALSE(saturated);
    return sum;
}

constexpr Quantum k_half{-1};

}  // namespace

TEST_CASE("any order and any grouping gives the same sum; floats do not") {
    HashRng rng(1);
    const Quantum quantum = quantum_for(1, 400);
    int float_sums_that_differ = 0;
    for (int trial = 0; trial < 200; ++trial) {
        std::vector<Rgb> samples = random_samples(rng, 2 + rng.next_u32() % 60);
        const PixelSum in_order = quantise_all(samples, quantum);
        const Rgb float_in_order = std::accumulate(samples.begin(), samples.end(), Rgb{});

        shuffle(samples, rng);
        std::vector<PixelSum> quantised;
        bool saturated = false;
        for (const Rgb sample : samples) quantised.push_back(quantise(sample, quantum, saturated));
        CHECK(add_in_groups(quantised, rng) == in_order);
        float_sums_that_differ += add_in_groups(samples, rng) != float_in_order;
    }
    CHECK(float_sums_that_differ > 50);  // Else the trials above would prove nothing.
}

TEST_CASE("the mean is within q / 2 of the true one, besides its rounding to float") {
    HashRng rng(2);
    for (int trial = 0; trial < 200; ++trial) {
        const Quantum quantum{-30 + int(rng.next_u32() % 28)};  // Coarse ones too, where q / 2 is what shows.
        const std::vector<Rgb> samples = random_samples(rng, 1 + rng.next_u32() % 500);
        const Rgb result = mean(quantise_all(samples, quantum), std::uint32_t(samples.size()), quantum);
        for (int c = 0; c < 3; ++c) {
            long double exact = 0;  // 64 bits of fraction: its own error is 1e-16 of the mean.
            for (const Rgb sample : samples) exact += sample[c];
            exact /= static_cast<long double>(samples.size());
            const long double bound = std::ldexp(0.5L, quantum.exponent) + exact * 0x1.0001p-24L;
            CHECK(std::abs(static_cast<long double>(result[c]) - exact) <= bound);
        }
    }
}

TEST_CASE("samples are rounded to the nearest quantum, ties to even") {
    bool saturated = false;
    CHECK(quantise({0.25f, 0.75f, 1.25f}, k_half, saturated) == PixelSum{0, 2, 2});
    CHECK(quantise({0.2501f, 0.7499f, 0}, k_half, saturated) == PixelSum{1, 1, 0});
    CHECK(quantise({0x1p-149f, 3, 1e9f}, k_half, saturated) == PixelSum{0, 6, 2'000'000'000});
    CHECK(quantise({0x1p-149f, 0, 0}, Quantum{-149}, saturated) == PixelSum{1, 0, 0});
    CHECK_FALSE(saturated);
}

TEST_CASE("what is too bright is clamped and said; what is not leaves the mark alone") {
    const float largest_exact = float(std::int64_t{1} << 42);
    bool saturated = false;
    CHECK(quantise({0, largest_exact, 0}, Quantum{0}, saturated).g == std::int64_t{1} << 42);
    CHECK_FALSE(saturated);
    CHECK(quantise({1, 2 * largest_exact, 3}, Quantum{0}, saturated) == PixelSum{1, k_max_quanta, 3});
    CHECK(saturated);
    CHECK(quantise({std::numeric_limits<float>::max(), 0, 0}, Quantum{-200}, saturated).r == k_max_quanta);
    CHECK(quantise({1, 1, 1}, Quantum{0}, saturated) == PixelSum{1, 1, 1});
    CHECK(saturated);
}

TEST_CASE("the most samples of the most light fit, one more does not") {
    bool saturated = false;
    const PixelSum brightest = quantise({1e30f, 1e30f, 1e30f}, Quantum{0}, saturated);
    PixelSum sum = brightest;
    for (int doubling = 0; doubling < 20; ++doubling) sum += sum;  // 2^20 of them, without overflow.
    CHECK(sum.r == k_max_quanta * k_max_samples_per_pixel);
    CHECK(in_range(sum, k_max_samples_per_pixel));
    CHECK(mean(sum, k_max_samples_per_pixel, Quantum{0}) == Rgb{0x1p43f, 0x1p43f, 0x1p43f});

    CHECK_FALSE(in_range(sum, k_max_samples_per_pixel - 1));
    CHECK_FALSE(in_range(sum, k_max_samples_per_pixel + 1));
    CHECK_FALSE(in_range(PixelSum{0, 0, -1}, 5));
    CHECK_FALSE(in_range(PixelSum{0, std::numeric_limits<std::int64_t>::max(), 0}, 5));
    CHECK_FALSE(in_range(PixelSum{1, 0, 0}, 0));
    CHECK(in_range(PixelSum{}, 0));
}

TEST_CASE("no samples are black") { CHECK(mean(PixelSum{}, 0, Quantum{}) == Rgb{}); }

TEST_CASE("quantum_for is the smallest power of two that is not below either share") {
    CHECK(quantum_for(1, 0) == Quantum{-32});
    CHECK(quantum_for(1, 256) == Quantum{-32});
    CHECK(quantum_for(1, 257) == Quantum{-31});
    CHECK(quantum_for(1.5f, 0) == Quantum{-31});
    CHECK(quantum_for(0, 1024) == Quantum{-30});
    CHECK(quantum_for(0, 0) == quantum_for(1, 0));

    HashRng rng(3);
    for (int trial = 0; trial < 1000; ++trial) {
        const float typical = std::exp(60 * rng.next_float() - 30);
        const float brightest = std::exp(60 * rng.next_float() - 30);
        const double share = std::max(typical * 0x1p-32, brightest * 0x1p-40);
        const double q = std::ldexp(1.0, quantum_for(typical, brightest).exponent);
        CHECK(q >= share);
        CHECK(q / 2 < share);
        bool saturated = false;
        (void)quantise({7.99f * brightest, 2047 * typical, 0}, quantum_for(typical, brightest), saturated);
        CHECK_FALSE(saturated);
    }
}

TEST_CASE("every radiance a float can hold has a quantum") {
    for (const float radiance :
         {std::numeric_limits<float>::denorm_min(), std::numeric_limits<float>::max()}) {
        CHECK(quantum_for(radiance, 0).valid());
        CHECK(quantum_for(0, radiance).valid());
        bool saturated = false;
        const Quantum quantum = quantum_for(radiance, radiance);
        const PixelSum sum = quantise({radiance, 0, radiance}, quantum, saturated);
        CHECK_FALSE(saturated);
        CHECK(mean(sum, 1, quantum) == Rgb{radiance, 0, radiance});
    }
}
