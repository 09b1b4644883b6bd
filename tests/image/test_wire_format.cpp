#include "pathscope/image/wire_format.hpp"

#include <cmath>
#include <vector>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

constexpr WireFormat k_lossy[] = {WireFormat::half, WireFormat::shared};
constexpr std::uint32_t k_samples = k_max_samples_per_pixel;

/// There and back.
std::vector<PixelSum> arrived(WireFormat format, const std::vector<PixelSum>& sums,
                              std::uint32_t samples = k_samples) {
    const std::string bytes = round_sums(format, sums);
    REQUIRE(bytes.size() == wire_bytes(format, sums.size()));
    std::vector<PixelSum> back(sums.size());
    const auto read = read_rounded_sums(format, bytes, samples, back);
    REQUIRE_MESSAGE(bool(read), read.error().message);
    return back;
}

/// Any number of bits equally likely, up to that many.
std::int64_t some_quanta(HashRng& rng, std::uint32_t most_bits) {
    const std::uint64_t bits = std::uint64_t(rng.next_u32()) << 32 | rng.next_u32();
    const std::uint32_t width = rng.next_u32() % (most_bits + 1);
    return width == 0 ? 0 : std::int64_t(bits >> (64 - width));
}

std::vector<PixelSum> some_block(HashRng& rng, std::uint32_t most_bits) {
    std::vector<PixelSum> sums(1 + rng.next_u32() % 64);
    for (PixelSum& sum : sums)
        sum = {some_quanta(rng, most_bits), some_quanta(rng, most_bits), some_quanta(rng, most_bits)};
    return sums;
}

double largest(const PixelSum& sum) { return double(std::max({sum.r, sum.g, sum.b})); }

double brightest(const std::vector<PixelSum>& sums) {
    double most = 0;
    for (const PixelSum& sum : sums) most = std::max(most, largest(sum));
    return most;
}

/// What the header promises: relative to `own` in range, relative to the brightest of the block below.
double allowed(WireFormat format, double sum, double largest_of_pixel, double block) {
    if (format == WireFormat::half)
        return sum >= std::ldexp(block, -28) ? std::ldexp(sum, -11) : std::ldexp(block, -39);
    return largest_of_pixel >= std::ldexp(block, -30) ? std::ldexp(largest_of_pixel, -9)
                                                      : std::ldexp(block, -39);
}

std::string refusal(WireFormat format, const std::string& bytes, std::size_t pixels,
                    std::uint32_t samples = k_samples) {
    std::vector<PixelSum> sums(pixels);
    const auto read = read_rounded_sums(format, bytes, samples, sums);
    if (!read) return read.error().message;
    for (const PixelSum& sum : sums) CHECK(in_range(sum, samples));
    return {};
}

}  // namespace

TEST_CASE("names of wire formats go both ways") {
    for (const auto& entry : k_wire_format_names) {
        CHECK(name_of(entry.value) == entry.name);
        CHECK(from_name<WireFormat>(entry.name) == entry.value);
    }
}

TEST_CASE("a block of 32 x 32 has 24, 6 and 4 bytes per pixel, and one for its exponent") {
    CHECK(wire_bytes(WireFormat::exact, 1024) == 24 * 1024);
    CHECK(wire_bytes(WireFormat::half, 1024) == 6 * 1024 + 1);
    CHECK(wire_bytes(WireFormat::shared, 1024) == 4 * 1024 + 1);
}

TEST_CASE("what a mantissa can hold comes back as it was") {
    for (const WireFormat format : k_lossy) {
        const std::int64_t most = format == WireFormat::half ? 2048 : 511;
        std::vector<PixelSum> sums;
        for (std::int64_t i = 0; i <= most; ++i) sums.push_back({i, most - i, i / 2});
        CHECK(arrived(format, sums) == sums);
    }
    // Powers of two have one bit; with `half` each channel by itself.
    std::vector<PixelSum> powers;
    for (int bit = 40; bit < 62; ++bit)
        powers.push_back({std::int64_t{1} << bit, 0, std::int64_t{3} << (bit - 2)});
    CHECK(arrived(WireFormat::half, powers) == powers);
    CHECK(arrived(WireFormat::shared, powers) == powers);
}

TEST_CASE("the codes are those of the document") {
    // 1 quantum beside 2^20: e = 21 - 15 = 6, so that 2^20 is the half 2^14 (0x7400) and 1 is 2^-6 (0x2400).
    const std::string half = round_sums(WireFormat::half, std::vector<PixelSum>{{1 << 20, 1, 0}});
    CHECK(half == std::string("\x06\x00\x00\x00\x74\x24\x00", 7));
    // 0x1ff << 3 beside 8 and 0: e = 0, own exponent 3, mantissas 0x1ff, 1 and 0.
    const std::string shared = round_sums(WireFormat::shared, std::vector<PixelSum>{{0x1ff << 3, 8, 0}});
    CHECK(shared == std::string("\x00\xff\x03\x00\x18", 5));
}

TEST_CASE("the error of any block stays within what is promised, and within one step of truth") {
    HashRng rng(7);
    for (const WireFormat format : k_lossy)
        for (int block = 0; block < 20'000; ++block) {
            const std::vector<PixelSum> sums = some_block(rng, 1 + rng.next_u32() % 62);
            const std::vector<PixelSum> back = arrived(format, sums);
            const double most = brightest(sums);
            for (std::size_t i = 0; i < sums.size(); ++i) {
                const std::pair<std::int64_t, std::int64_t> channels[] = {
                    {sums[i].r, back[i].r}, {sums[i].g, back[i].g}, {sums[i].b, back[i].b}};
                for (const auto& [before, after] : channels) {
                    const double error = std::abs(double(before - after));
                    REQUIRE(error <= allowed(format, double(before), largest(sums[i]), most));
                    if (before == 0) REQUIRE(after == 0);
                }
            }
        }
}

TEST_CASE("half rounds to the nearest, and its mean error is none") {
    // Uniform sums over two binades: unbiased rounding leaves a mean of 0 +- step / sqrt(12 n), 5 sigma allowed.
    HashRng rng(8);
    constexpr int k_count = 100'000;
    std::vector<PixelSum> sums(k_count);
    for (PixelSum& sum : sums) {
        const std::int64_t quanta = (std::int64_t{1} << 30) + (rng.next_u32() >> 2);
        sum = {quanta, quanta, quanta};
    }
    const std::vector<PixelSum> back = arrived(WireFormat::half, sums);
    double mean = 0;
    for (int i = 0; i < k_count; ++i)
        mean += double(back[std::size_t(i)].r - sums[std::size_t(i)].r) / k_count;
    const double step = std::ldexp(1.0, 31 - 11);
    CHECK(std::abs(mean) < 5 * step / std::sqrt(12.0 * k_count));
}

TEST_CASE("saturated samples stay within the range of sums, and no code is infinite") {
    for (const WireFormat format : k_lossy)
        for (const std::uint32_t samples : {1u, 2u, 3u, 4u, 7u, 1000u, k_samples}) {
            const std::int64_t most = k_max_quanta * std::int64_t{samples};
            const std::vector<PixelSum> back =
                arrived(format, {{most, most - 1, most / 2}, {most, 0, 1}, {1, 2, 3}}, samples);
            for (const PixelSum& sum : back) CHECK(in_range(sum, samples));
            CHECK(double(back[0].r) >= double(most) * (1 - std::ldexp(1.0, -9)));
        }
}

TEST_CASE(
    "bytes that no sums have are refused: exponents, signs, infinities, and what is beyond the samples") {
    for (const WireFormat format : k_lossy) {
        const std::string good = round_sums(format, std::vector<PixelSum>(3, {100, 200, 300}));
        REQUIRE(refusal(format, good, 3).empty());
        for (const int exponent : {format == WireFormat::half ? 49 : 25, 64, 127, 128, 255}) {
            std::string bad = good;
            bad[0] = char(exponent);
            CHECK(refusal(format, bad, 3).find("exponent of the block") != std::string::npos);
        }
        CHECK(refusal(format, good, 3, k_samples + 1).find("No sum has") != std::string::npos);
        // One sample adds up to 2^43 - 1 at most; what was rounded up a little is forgiven, twice as much is not.
        const std::string twice = round_sums(format, std::vector<PixelSum>{{2 * k_max_quanta, 0, 0}});
        CHECK(refusal(format, twice, 1, 2).empty());
        CHECK(refusal(format, twice, 1, 1).find("beyond what 1 samples") != std::string::npos);
    }
    for (const int high :
         {0x7c, 0x7e, 0xfc, 0x80, 0x84, 0xff}) {  // Infinity, NaN, -infinity, -0, -2^-14, NaN.
        const std::string bad{0, 0, 0, 0, char(high), 0, 0};
        CHECK(refusal(WireFormat::half, bad, 1).find("not a number") != std::string::npos);
    }
}

TEST_CASE("whatever the bytes are, sums that are taken are in range, and round to themselves") {
    HashRng rng(9);
    int taken = 0;
    for (const WireFormat format : k_lossy)
        for (int i = 0; i < 100'000; ++i) {
            const std::size_t pixels = 1 + rng.next_u32() % 4;
            std::string bytes(wire_bytes(format, pixels), '\0');
            for (char& byte : bytes) byte = char(rng.next_u32() >> rng.next_u32() % 8);
            bytes[0] = char(rng.next_u32() % 32);
            const std::uint32_t samples = 1 + (rng.next_u32() % k_samples);
            std::vector<PixelSum> sums(pixels);
            if (!read_rounded_sums(format, bytes, samples, sums)) continue;
            ++taken;
            for (const PixelSum& sum : sums) REQUIRE(in_range(sum, samples));
            const std::vector<PixelSum> again = arrived(format, sums, samples);
            const double most = brightest(sums);
            for (std::size_t p = 0; p < pixels; ++p)
                REQUIRE(std::abs(double(sums[p].r - again[p].r)) <=
                        allowed(format, double(sums[p].r), largest(sums[p]), most));
        }
    CHECK(taken > 1000);
}
