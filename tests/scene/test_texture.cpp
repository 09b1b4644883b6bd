#include <cmath>
#include <limits>

#include "pathscope/image/tonemap.hpp"
#include "pathscope/math/random.hpp"
#include "pathscope/scene/texture.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

Image8 image_of(int width, int height, int channels, std::vector<std::uint8_t> bytes) {
    Image8 image;
    image.width = width;
    image.height = height;
    image.channels = channels;
    image.bytes = std::move(bytes);
    return image;
}

Image8 any_image(HashRng& rng, int width, int height, int channels) {
    std::vector<std::uint8_t> bytes(std::size_t(width * height * channels));
    for (auto& byte : bytes) byte = std::uint8_t(rng.next_u32());
    return image_of(width, height, channels, std::move(bytes));
}

double wrapped(double x, double size) { return x - std::floor(x / size) * size; }

/// Bilinear look-up as the header states it, in double, by the tent that each texel spans.
double reference(const Image8& image, int channel, double (*decode)(int), Vec2 uv) {
    const double x = wrapped(double(uv.x) * image.width, image.width);
    const double y = wrapped((1 - double(uv.y)) * image.height, image.height);
    double sum = 0;
    for (int row = 0; row < image.height; ++row)
        for (int column = 0; column < image.width; ++column)
            for (int turn_x = -1; turn_x <= 1; ++turn_x)
                for (int turn_y = -1; turn_y <= 1; ++turn_y) {
                    const double dx = std::abs(x - (column + 0.5 + turn_x * image.width));
                    const double dy = std::abs(y - (row + 0.5 + turn_y * image.height));
                    const auto byte = std::size_t((row * image.width + column) * image.channels + channel);
                    sum += std::max(0.0, 1 - dx) * std::max(0.0, 1 - dy) * decode(image.bytes[byte]);
                }
    return sum;
}
double srgb(int code) { return double(decode_srgb8(std::uint8_t(code))); }
double plain(int code) { return code / 255.0; }

}  // namespace

TEST_CASE("v = 0 is the bottom row, u = 0 the left column") {
    const Texture texture(TextureUsage::colour, image_of(2, 2, 3,
                                                         {255, 0, 0, 0, 255, 0,  //
                                                          0, 0, 255, 255, 255, 255}));
    CHECK(texture.eval({0.25f, 0.75f}) == Rgb{1, 0, 0});
    CHECK(texture.eval({0.75f, 0.75f}) == Rgb{0, 1, 0});
    CHECK(texture.eval({0.25f, 0.25f}) == Rgb{0, 0, 1});
    CHECK(texture.eval({0.75f, 0.25f}) == Rgb{1, 1, 1});
    CHECK(texture.eval({0.5f, 0.75f}) == Rgb{0.5f, 0.5f, 0});
    CHECK(texture.eval({0, 0.25f}) == Rgb{0.5f, 0.5f, 1});  // Half of it comes around the edge.
}

TEST_CASE("colours are decoded from sRGB before they are mixed, grey values are not") {
    const Image8 image = image_of(2, 1, 1, {188, 0});
    const Texture colour(TextureUsage::colour, image), grey(TextureUsage::grey, image);
    CHECK(colour.eval({0.25f, 0.5f}).x == decode_srgb8(188));
    CHECK(colour.eval({0.5f, 0.5f}).x == decode_srgb8(188) / 2);
    CHECK(grey.eval_grey({0.25f, 0.5f}) == 188 / 255.0f);
    CHECK(grey.eval({0.5f, 0.5f}) == Rgb{94 / 255.0f, 94 / 255.0f, 94 / 255.0f});
    CHECK(colour.bytes() == 4 * grey.bytes());
}

TEST_CASE("in the space of codes, colours are mixed first and decoded afterwards") {
    const Image8 image = image_of(2, 1, 1, {188, 0});
    const Texture codes(TextureUsage::colour, image, TexelSpace::srgb);
    CHECK(codes.eval({0.25f, 0.5f}).x == doctest::Approx(decode_srgb8(188)));
    CHECK(codes.eval({0.5f, 0.5f}).x == doctest::Approx(decode_srgb8(94)));
    const Texture grey(TextureUsage::grey, image, TexelSpace::srgb);
    CHECK(grey.eval_grey({0.5f, 0.5f}) == 94 / 255.0f);
}

TEST_CASE("a texture agrees with a sum over all texels, at any uv and for any size") {
    HashRng rng(3);
    for (const auto& [width, height] : {std::pair{1, 1}, {2, 3}, {4, 4}, {5, 9}, {13, 6}}) {
        const Image8 rgb = any_image(rng, width, height, 3), mask = any_image(rng, width, height, 1);
        const Texture colour(TextureUsage::colour, rgb), grey(TextureUsage::grey, mask);
        for (int i = 0; i < 300; ++i) {
            const Vec2 uv{8 * rng.next_float() - 4, 8 * rng.next_float() - 4};
            const Rgb value = colour.eval(uv);
            // uv has 22 bits after the point, times at most 13 texels.
            for (int channel = 0; channel < 3; ++channel)
                CHECK(std::abs(double(value[channel]) - reference(rgb, channel, srgb, uv)) < 2e-5);
            CHECK(std::abs(double(grey.eval_grey(uv)) - reference(mask, 0, plain, uv)) < 2e-5);
        }
    }
}

TEST_CASE("a texture repeats without end") {
    HashRng rng(4);
    const Texture texture(TextureUsage::colour, any_image(rng, 8, 8, 3));
    for (int i = 0; i < 100; ++i) {
        const Vec2 uv{float(rng.next_u32() % 256) / 256, float(rng.next_u32() % 256) / 256};
        CHECK(texture.eval(uv) == texture.eval({uv.x + 5, uv.y - 7}));
    }
}

TEST_CASE("no uv reads outside of the texture") {
    const Texture texture(TextureUsage::grey, image_of(3, 3, 1, std::vector<std::uint8_t>(9, 255)));
    const float infinity = std::numeric_limits<float>::infinity();
    for (const float t : {-1e-9f, -1e-38f, 1.0f, k_one_minus_epsilon, -0.0f, 1e30f, -1e30f, infinity,
                          -infinity, std::nanf("")}) {
        CHECK(texture.eval_grey({t, 0.5f}) == 1);
        CHECK(texture.eval_grey({0.5f, t}) == 1);
    }
}

TEST_CASE("a grey texture takes the alpha channel where it says something, else the luminance") {
    const auto grey_at_centre = [](int channels, std::vector<std::uint8_t> bytes) {
        return std::lround(
            Texture(TextureUsage::grey, image_of(1, 1, channels, std::move(bytes))).eval_grey({}) * 255);
    };
    CHECK(grey_at_centre(1, {10}) == 10);
    CHECK(grey_at_centre(2, {10, 40}) == 40);
    CHECK(grey_at_centre(2, {10, 255}) == 10);
    CHECK(grey_at_centre(3, {77, 77, 77}) == 77);
    CHECK(grey_at_centre(3, {255, 0, 0}) == 54);
    CHECK(grey_at_centre(4, {77, 77, 77, 3}) == 3);
    CHECK(grey_at_centre(4, {77, 77, 77, 255}) == 77);
}

TEST_CASE("bytes that are no image are an error with the name") {
    const auto texture = decode_texture("not an image", TextureUsage::colour, TexelSpace::linear, "a.png");
    REQUIRE_FALSE(texture);
    CHECK(texture.error().message.find("a.png") != std::string::npos);
}
