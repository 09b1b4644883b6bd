#include "pathscope/scene/texture.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pathscope/core/check.hpp"
#include "pathscope/image/io.hpp"
#include "pathscope/image/tonemap.hpp"

namespace pathscope {
namespace {

constexpr std::size_t k_tile = 4;  // Texels on a side.

std::array<float, 256> make_table(float (*decode)(std::uint8_t)) {
    std::array<float, 256> table;
    for (int code = 0; code < 256; ++code) table[std::size_t(code)] = decode(std::uint8_t(code));
    return table;
}
const std::array<float, 256> k_srgb_to_linear = make_table(decode_srgb8);
const std::array<float, 256> k_plain = make_table([](std::uint8_t code) { return float(code) / 255.0f; });

/// Where texel (x, y), counted from the upper left, lies among the texels.
std::size_t texel_index(std::size_t x, std::size_t y, std::size_t tiles_per_row) {
    const std::size_t tile = y / k_tile * tiles_per_row + x / k_tile;
    return tile * (k_tile * k_tile) + y % k_tile * k_tile + x % k_tile;
}

/// One axis of a bilinear look-up: two neighbouring texels and the weight of the second.
struct Footprint {
    std::size_t first, second;
    float weight;
};

Footprint footprint(float t, int size) {
    t -= std::floor(t);
    if (!(t >= 0)) t = 0;
    const float x = t * float(size) - 0.5f;
    const float below = std::floor(x);
    const int first = int(below);  // -1 to size - 1
    return {std::size_t(first < 0 ? size - 1 : first), std::size_t(first + 1 == size ? 0 : first + 1),
            x - below};
}

bool has_alpha(const Image8& image) { return image.channels == 2 || image.channels == 4; }

bool is_opaque(const Image8& image) {
    const auto channels = std::size_t(image.channels);
    for (std::size_t i = channels - 1; i < image.bytes.size(); i += channels)
        if (image.bytes[i] != 255) return false;
    return true;
}

std::uint8_t grey_of(const std::uint8_t* pixel, int channels, bool take_alpha) {
    if (take_alpha) return pixel[channels - 1];
    if (channels <= 2) return pixel[0];
    return std::uint8_t(std::lround(luminance({float(pixel[0]), float(pixel[1]), float(pixel[2])})));
}

}  // namespace

Texture::Texture(TextureUsage usage, const Image8& image, TexelSpace space)
    : usage_(usage), space_(space), width_(image.width), height_(image.height) {
    CHECK(width_ > 0 && height_ > 0 && image.channels >= 1 && image.channels <= 4, width_, height_,
          image.channels);
    const auto width = std::size_t(width_), height = std::size_t(height_),
               channels = std::size_t(image.channels);
    CHECK(image.bytes.size() == width * height * channels, image.bytes.size(), width, height, channels);

    tiles_per_row_ = (width + k_tile - 1) / k_tile;
    const std::size_t tiles = tiles_per_row_ * ((height + k_tile - 1) / k_tile);
    const std::size_t texel_bytes = usage == TextureUsage::colour ? 4 : 1;
    texels_.resize(tiles * k_tile * k_tile * texel_bytes);

    const bool take_alpha = usage == TextureUsage::grey && has_alpha(image) && !is_opaque(image);
    const std::size_t green = channels >= 3 ? 1 : 0, blue = channels >= 3 ? 2 : 0;
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) {
            const std::uint8_t* pixel = &image.bytes[(y * width + x) * channels];
            std::uint8_t* texel = &texels_[texel_index(x, y, tiles_per_row_) * texel_bytes];
            if (usage == TextureUsage::grey) {
                texel[0] = grey_of(pixel, image.channels, take_alpha);
            } else {
                texel[0] = pixel[0];
                texel[1] = pixel[green];
                texel[2] = pixel[blue];
            }
        }
}

Rgb Texture::eval(Vec2 uv) const {
    if (usage_ == TextureUsage::grey) {
        const float grey = eval_grey(uv);
        return {grey, grey, grey};
    }
    const Footprint x = footprint(uv.x, width_), y = footprint(1 - uv.y, height_);
    const auto blend = [&](const std::array<float, 256>& value_of) {
        const auto texel = [&](std::size_t column, std::size_t row) {
            const std::uint8_t* rgb = &texels_[texel_index(column, row, tiles_per_row_) * 4];
            return Rgb{value_of[rgb[0]], value_of[rgb[1]], value_of[rgb[2]]};
        };
        return lerp(lerp(texel(x.first, y.first), texel(x.second, y.first), x.weight),
                    lerp(texel(x.first, y.second), texel(x.second, y.second), x.weight), y.weight);
    };
    if (space_ == TexelSpace::linear) return blend(k_srgb_to_linear);
    const Rgb code = blend(k_plain);
    return {decode_srgb(code.x), decode_srgb(code.y), decode_srgb(code.z)};
}

float Texture::eval_grey(Vec2 uv) const {
    if (usage_ == TextureUsage::colour) return luminance(eval(uv));
    const Footprint x = footprint(uv.x, width_), y = footprint(1 - uv.y, height_);
    const auto texel = [&](std::size_t column, std::size_t row) {
        return float(texels_[texel_index(column, row, tiles_per_row_)]);
    };
    return lerp(lerp(texel(x.first, y.first), texel(x.second, y.first), x.weight),
                lerp(texel(x.first, y.second), texel(x.second, y.second), x.weight), y.weight) /
           255.0f;
}

Result<Texture> decode_texture(std::string_view bytes, TextureUsage usage, TexelSpace space,
                               const std::string& name) {
    const Result<Image8> image = decode_ldr(bytes, name);
    if (!image) return image.error();
    return Texture(usage, *image, space);
}

}  // namespace pathscope
