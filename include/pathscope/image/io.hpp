#pragma once
/// Pictures in and out of files.
///
///   .exr  OpenEXR, 32-bit float, ZIP: all layers. The first layer that is an Image has the channels R, G, B
///   whatever
///         its name, further Images NAME.R, NAME.G, NAME.B; a Plane is one channel with the layer's name as
///         it is
///         ("depth.Z", "spp").
///   .pfm  Portable float map, linear: the first layer; bottom row first, little endian ("-1.0").
///   .png  8-bit sRGB, tone-mapped: the first layer.
///
/// Why: the extension alone decides, so that a command line needs no format flag. Writing is atomic (a reader
/// sees the old file or the new one), and values in .exr and .pfm come back bit for bit, NaN and infinity
/// too. Limits: a picture read has sides up to k_max_image_side and up to k_max_pixels pixels; files that
/// claim more are refused before memory is taken. Of 8-bit formats .png, .jpg, .bmp and .tga are read.
/// Errors: bad_input, one sentence that names the file (or the `name` given with the bytes).
/// Thread safety: yes, for different paths.   Test: tests/image/test_io.cpp

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/image/image.hpp"
#include "pathscope/image/tonemap.hpp"

namespace pathscope {

inline constexpr std::int64_t k_max_pixels = std::int64_t{1} << 27;  ///< 16384 x 8192: 1.5 GiB as an Image.

/// Text that travels in the file's header; only .exr keeps it. Keys are letters, digits, '_' and '-'.
using Metadata = std::map<std::string, std::string>;

/// A picture to be saved; it is not copied, and must live as long as the call.
struct ImageLayer {
    std::string name;
    std::variant<const Image*, const Plane*> picture;
};

struct SaveOptions {
    ToneMapParams tone_map;  ///< For .png.
    Metadata metadata;       ///< For .exr.
};

/// Whether save_image() would accept this name and can write there: the extension is one of the three, and a
/// file can be made beside the target. Ask this before an hour of rendering.
[[nodiscard]] Result<void> check_writable(const std::filesystem::path& path);

/// Requires: at least one layer, the first an Image; all of the same size, not empty; names different.
[[nodiscard]] Result<void> save_image(const std::filesystem::path& path, std::span<const ImageLayer> layers,
                                      const SaveOptions& options = {});
[[nodiscard]] Result<void> save_image(const std::filesystem::path& path, const Image& image,
                                      const SaveOptions& options = {});

/// A picture from a file or from bytes, linear: .exr (its R, G, B, or Y as grey), .pfm and .hdr as they are,
/// 8-bit formats decoded from sRGB. The content decides, not the name. Values may be negative or not finite.
[[nodiscard]] Result<Image> load_image(const std::filesystem::path& path);
[[nodiscard]] Result<Image> decode_hdr(std::string_view bytes, std::string_view name);

/// An 8-bit picture as the file has it, with its own number of channels.
[[nodiscard]] Result<Image8> decode_ldr(std::string_view bytes, std::string_view name);

/// All that an .exr of ours holds: R, G, B come back as the layer "", NAME.R/.G/.B as an Image, the rest as
/// Planes.
struct LayeredImage {
    std::map<std::string, Image> images;
    std::map<std::string, Plane> planes;
    Metadata metadata;
};
[[nodiscard]] Result<LayeredImage> load_layers(const std::filesystem::path& path);

}  // namespace pathscope
