#pragma once
/// An image on a surface: 8-bit texels, bilinear, repeated without end.
///
///   uv -> texel space (u * width - 1/2, (1 - v) * height - 1/2); the four texels around it are weighted
///
/// Convention: as in OBJ, u runs to the right and v upwards, (0, 0) is the lower left corner of the image; the
/// rows of image files start at the top. Texel centres lie at half-integers. A colour texture holds codes of
/// sRGB, decoded to linear light before they are weighted (TexelSpace); a grey one holds plain numbers n / 255.
/// There are no mipmaps: a pixel's samples average the texels it sees. A uv that is not finite counts as 0.
///
/// Why tiles: texels lie in 4x4 tiles, of 64 bytes (a cache line) for colours, because scattered look-ups of
/// 2x2 texels then touch 1.6 lines on average in place of 2.1.
///
/// Thread safety: reading from any thread.   Test: tests/scene/test_texture.cpp

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/core/huge_pages.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/image/image.hpp"
#include "pathscope/math/vec.hpp"

namespace pathscope {

enum class TextureUsage {
    colour,  ///< sRGB; 4 bytes per texel (3 used).
    grey,    ///< Linear; 1 byte per texel: the alpha channel if it is not all opaque, else the luminance.
};

/// In what the texels of a colour texture are weighted.
enum class TexelSpace : std::uint8_t {
    linear,  ///< Light: the mean of two texels sends half the light of each.
    srgb,    ///< Codes, decoded afterwards, as some renderers do: darker where neighbours differ.
};
inline constexpr std::array k_texel_space_names{
    EnumName{TexelSpace::linear, "linear"},
    EnumName{TexelSpace::srgb, "srgb"},
};
constexpr const auto& enum_table(TexelSpace) { return k_texel_space_names; }

class Texture {
  public:
    /// Requires: at least one pixel, 1 to 4 channels.
    Texture(TextureUsage usage, const Image8& image, TexelSpace space = TexelSpace::linear);

    [[nodiscard]] Rgb eval(Vec2 uv) const;  ///< Linear colour; a grey texture gives three equal values.
    [[nodiscard]] float eval_grey(Vec2 uv) const;  ///< In [0, 1]; of a colour texture the luminance.

    [[nodiscard]] int width() const { return width_; }
    [[nodiscard]] int height() const { return height_; }
    [[nodiscard]] TextureUsage usage() const { return usage_; }
    [[nodiscard]] std::size_t bytes() const { return texels_.size(); }

    friend bool operator==(const Texture&, const Texture&) = default;

  private:
    TextureUsage usage_;
    TexelSpace space_;
    int width_, height_;
    std::size_t tiles_per_row_;
    HugePageVector<std::uint8_t> texels_;  // Read at random.
};

/// Decodes an image file (PNG, JPEG, TGA, BMP). `name` is for the error sentence.
[[nodiscard]] Result<Texture> decode_texture(std::string_view bytes, TextureUsage usage, TexelSpace space,
                                             const std::string& name);

}  // namespace pathscope
