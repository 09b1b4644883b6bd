#pragma once
/// What io.cpp knows of each file format: bytes to pictures and back. Private to the module.
///
/// `name` stands in the sentences of errors: a path, or what the caller calls the bytes.

#include <optional>
#include <string>
#include <string_view>

#include "pathscope/image/io.hpp"

namespace pathscope {

/// Refuses sizes that no picture has, before memory is taken for them.
[[nodiscard]] Result<void> check_picture_size(std::int64_t width, std::int64_t height, std::string_view name);

/// Requires: what save_image() requires.
[[nodiscard]] Result<std::string> encode_exr(std::span<const ImageLayer> layers, const Metadata& metadata,
                                             std::string_view name);
[[nodiscard]] Result<std::string> encode_png(const Image8& image, std::string_view name);
[[nodiscard]] std::string encode_pfm(const Image& image);

[[nodiscard]] bool is_exr(std::string_view bytes);
[[nodiscard]] bool is_pfm(std::string_view bytes);
[[nodiscard]] bool is_rgbe(std::string_view bytes);

[[nodiscard]] Result<Image> decode_exr(std::string_view bytes, std::string_view name);
[[nodiscard]] Result<LayeredImage> decode_exr_layers(std::string_view bytes, std::string_view name);
[[nodiscard]] Result<Image> decode_pfm(std::string_view bytes, std::string_view name);
[[nodiscard]] Result<Image> decode_rgbe(std::string_view bytes, std::string_view name);  ///< Radiance .hdr

}  // namespace pathscope
