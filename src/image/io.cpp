#include "pathscope/image/io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <set>

#include "formats.hpp"
#include "pathscope/core/files.hpp"

namespace pathscope {
namespace {

enum class Format { exr, pfm, png };

std::string lower_case(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return text;
}

Result<Format> format_of(const std::filesystem::path& path) {
    const std::string extension = lower_case(path.extension().string());
    if (extension == ".exr") return Format::exr;
    if (extension == ".pfm") return Format::pfm;
    if (extension == ".png") return Format::png;
    return bad_input(
        fmt::format("{}: the file name of a picture must end in .exr, .png or .pfm.", path.string()));
}

PixelRect rect_of(const ImageLayer& layer) {
    return std::visit([](const auto* picture) { return picture->rect(); }, layer.picture);
}

void check_layers(std::span<const ImageLayer> layers) {
    CHECK(!layers.empty() && std::holds_alternative<const Image*>(layers[0].picture), layers.size());
    const PixelRect rect = rect_of(layers[0]);
    CHECK(!rect.empty(), rect);
    std::set<std::string> names;
    for (const ImageLayer& layer : layers) {
        CHECK(rect_of(layer) == rect, layer.name, rect_of(layer), rect);
        CHECK(names.insert(layer.name).second, layer.name);
    }
}

Result<std::string> encode(Format format, std::span<const ImageLayer> layers, const SaveOptions& options,
                           std::string_view name) {
    const Image& first = *std::get<const Image*>(layers[0].picture);
    if (format == Format::exr) return encode_exr(layers, options.metadata, name);
    if (format == Format::pfm) return encode_pfm(first);
    Image8 screen;
    tone_map(first, options.tone_map, 3, screen);
    return encode_png(screen, name);
}

/// Grey is repeated; alpha is left out.
Image linear_image(const Image8& image8) {
    Image image(image8.width, image8.height);
    const std::size_t channels = std::size_t(image8.channels);
    const std::size_t step = channels >= 3 ? 1 : 0;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const std::uint8_t* pixel = &image8.bytes[i * channels];
        image.pixels[i] = {decode_srgb8(pixel[0]), decode_srgb8(pixel[step]), decode_srgb8(pixel[2 * step])};
    }
    return image;
}

}  // namespace

Result<void> check_picture_size(std::int64_t width, std::int64_t height, std::string_view name) {
    if (width >= 1 && height >= 1 && width <= k_max_image_side && height <= k_max_image_side &&
        width * height <= k_max_pixels)
        return {};
    return bad_input(
        fmt::format("{}: says it has {}x{} pixels; a side is 1 to {} pixels, and the area at most {}.", name,
                    width, height, k_max_image_side, k_max_pixels));
}

Result<void> check_writable(const std::filesystem::path& path) {
    if (const auto format = format_of(path); !format) return format.error();
    return check_place(path);
}

Result<void> save_image(const std::filesystem::path& path, std::span<const ImageLayer> layers,
                        const SaveOptions& options) {
    check_layers(layers);
    const auto format = format_of(path);
    if (!format) return format.error();
    const auto bytes = encode(*format, layers, options, path.string());
    if (!bytes) return bytes.error();
    return write_file_atomically(path, *bytes);
}

Result<void> save_image(const std::filesystem::path& path, const Image& image, const SaveOptions& options) {
    const std::array layers{ImageLayer{"", &image}};
    return save_image(path, layers, options);
}

Result<Image> decode_hdr(std::string_view bytes, std::string_view name) {
    if (is_exr(bytes)) return decode_exr(bytes, name);
    if (is_pfm(bytes)) return decode_pfm(bytes, name);
    if (is_rgbe(bytes)) return decode_rgbe(bytes, name);
    const auto image8 = decode_ldr(bytes, name);
    if (!image8) return image8.error();
    return linear_image(*image8);
}

Result<Image> load_image(const std::filesystem::path& path) {
    const auto bytes = read_file(path);
    if (!bytes) return bytes.error();
    return decode_hdr(*bytes, path.string());
}

Result<LayeredImage> load_layers(const std::filesystem::path& path) {
    const auto bytes = read_file(path);
    if (!bytes) return bytes.error();
    return decode_exr_layers(*bytes, path.string());
}

}  // namespace pathscope
