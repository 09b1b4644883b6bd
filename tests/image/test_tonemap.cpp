#include "pathscope/image/tonemap.hpp"

#include <cmath>
#include <limits>

#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

using Pixel8 = std::array<std::uint8_t, 3>;
constexpr ToneMapParams k_linear{0, ToneCurve::linear};

/// The standard's equation, rounded to the nearest code: what the table must agree with.
int encode_by_equation(double linear) {
    const double clipped = std::clamp(linear, 0.0, 1.0);
    const double v = clipped <= 0.0031308 ? 12.92 * clipped : 1.055 * std::pow(clipped, 1 / 2.4) - 0.055;
    return int(std::floor(v * 255 + 0.5));
}

}  // namespace

TEST_CASE("sRGB: values of the standard") {
    CHECK(encode_srgb(0.5f) == doctest::Approx(0.735357).epsilon(1e-5));
    CHECK(decode_srgb(0.5f) == doctest::Approx(0.214041).epsilon(1e-5));
    CHECK(encode_srgb(0.001f) == doctest::Approx(0.01292).epsilon(1e-5));
    CHECK(decode_srgb8(0) == 0);
    CHECK(decode_srgb8(255) == 1);
    for (int i = 0; i <= 1000; ++i)
        CHECK(decode_srgb(encode_srgb(float(i) / 1000)) == doctest::Approx(i / 1000.0).epsilon(1e-5));
}

TEST_CASE("decode_srgb is off the standard's equation by less than 2.5e-6 of its value, and never above 1") {
    for (int i = 0; i <= 100'000; ++i) {
        const float encoded = float(i) / 100'000;
        const double x = encoded;
        const double exact = x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
        REQUIRE(std::abs(double(decode_srgb(encoded)) - exact) <= 2.5e-6 * exact);
        REQUIRE(decode_srgb(encoded) <= 1);
    }
}

TEST_CASE("encode_srgb8 is correctly rounded") {
    for (int code = 0; code < 256; ++code) CHECK(encode_srgb8(decode_srgb8(std::uint8_t(code))) == code);
    HashRng rng(1);
    int wrong = 0;
    for (int i = 0; i < 200'000; ++i) {
        const float x = i % 2 ? rng.next_float() : std::exp(-12 * rng.next_float());
        wrong += encode_srgb8(x) != encode_by_equation(double(x));
    }
    CHECK(wrong == 0);
    // At both sides of each threshold, where a table goes wrong first.
    for (int code = 1; code < 256; ++code) {
        const double v = (code - 0.5) / 255;
        const double threshold = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
        CHECK(encode_srgb8(float(threshold * (1 - 1e-6))) == code - 1);
        CHECK(encode_srgb8(float(threshold * (1 + 1e-6))) == code);
    }
    CHECK(encode_srgb8(-1) == 0);
    CHECK(encode_srgb8(2) == 255);
    CHECK(encode_srgb8(std::numeric_limits<float>::infinity()) == 255);
    CHECK(encode_srgb8(std::numeric_limits<float>::quiet_NaN()) == 0);
}

TEST_CASE("each curve follows its equation") {
    const auto grey = [](float x, ToneCurve curve) { return int(tone_map({x, x, x}, {0, curve})[0]); };
    for (const float x : {0.0f, 0.01f, 0.18f, 0.5f, 1.0f, 3.0f, 20.0f}) {
        CHECK(grey(x, ToneCurve::linear) == encode_by_equation(x));
        CHECK(grey(x, ToneCurve::reinhard) == encode_by_equation(x / (1.0 + x)));
        CHECK(grey(x, ToneCurve::filmic) ==
              encode_by_equation(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14)));
    }
}

TEST_CASE("one stop of exposure doubles the light") {
    const Rgb radiance{0.1f, 0.2f, 0.05f};
    for (const auto& [curve, name] : k_tone_curve_names) {
        CHECK(tone_map(radiance, {1, curve}) == tone_map(radiance * 2, {0, curve}));
        CHECK(tone_map(radiance, {-2, curve}) == tone_map(radiance * 0.25f, {0, curve}));
        CHECK(from_name<ToneCurve>(name) == curve);
    }
}

TEST_CASE("what cannot be shown is marked or clipped, under every curve") {
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    for (const auto& [curve, name] : k_tone_curve_names) {
        CAPTURE(name);
        const ToneMapParams params{0, curve};
        CHECK(tone_map({0.5f, nan, 0.5f}, params) == Pixel8{255, 0, 255});
        CHECK(tone_map({inf, -1, -inf}, params) == Pixel8{255, 0, 0});
        CHECK(tone_map({std::numeric_limits<float>::max(), 0, 0}, params) == Pixel8{255, 0, 0});
    }
}

TEST_CASE("a whole picture is its pixels, with three or four channels, for any number of threads") {
    HashRng rng(2);
    Image image(37, 53);
    for (Rgb& pixel : image.pixels) pixel = {4 * rng.next_float(), rng.next_float(), 9 * rng.next_float()};
    const ToneMapParams params{0.5f, ToneCurve::filmic};
    Image8 rgb, rgba;
    tone_map(image, params, 3, rgb, 1);
    tone_map(image, params, 4, rgba, 4);
    REQUIRE(rgb.bytes.size() == image.pixels.size() * 3);
    REQUIRE(rgba.bytes.size() == image.pixels.size() * 4);
    bool same = true;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const Pixel8 expected = tone_map(image.pixels[i], params);
        for (std::size_t c = 0; c < 3; ++c)
            same = same && rgb.bytes[3 * i + c] == expected[c] && rgba.bytes[4 * i + c] == expected[c];
        same = same && rgba.bytes[4 * i + 3] == 255;
    }
    CHECK(same);
}
