/// 8-bit formats and Radiance .hdr, by stb_image and stb_image_write, compiled here and not linked: with only the
/// formats that scenes use (others have had bugs, and nobody needs them), and with memory from a budget, because a
/// small .png may inflate without end.

#include <fmt/format.h>

#include <climits>
#include <cstdlib>
#include <memory>

#include "formats.hpp"
#include "jpeg_tables.hpp"

namespace {

/// Bytes that the decoder on this thread may still ask for. What it gives back is not credited: growing buffers ask
/// for twice their size in all, which the budget allows for.
thread_local std::size_t t_budget_bytes = 0;

bool take_from_budget(std::size_t bytes) {
    if (bytes > t_budget_bytes) return false;
    t_budget_bytes -= bytes;
    return true;
}

void* budget_malloc(std::size_t bytes) { return take_from_budget(bytes) ? std::malloc(bytes) : nullptr; }
void* budget_realloc(void* old, std::size_t bytes) {
    return take_from_budget(bytes) ? std::realloc(old, bytes) : nullptr;
}

}  // namespace

// Sums and shifts that overflow, and no bytes copied to nowhere, are the library's own; what it writes beyond its memory is not.
#if defined(__clang__)
#pragma clang attribute push(                                                              \
    __attribute__((no_sanitize("signed-integer-overflow", "shift", "nonnull-attribute"))), \
    apply_to = function)
#endif

#define STBI_MALLOC(bytes) budget_malloc(bytes)
#define STBI_REALLOC(old, bytes) budget_realloc(old, bytes)
#define STBI_FREE(memory) std::free(memory)
#define STBI_NO_STDIO
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#define STBI_ONLY_BMP
#define STBI_ONLY_TGA
#define STBI_ONLY_HDR
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#include <stb_image.h>

#define STBI_WRITE_NO_STDIO
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb_image_write.h>

#if defined(__clang__)
#pragma clang attribute pop
#endif

namespace pathscope {
namespace {

template <class Value>
struct FreeStb {
    void operator()(Value* values) const { stbi_image_free(values); }
};
template <class Value>
using StbPixels = std::unique_ptr<Value, FreeStb<Value>>;

struct PictureInfo {
    int width = 0, height = 0, channels = 0;
};

const stbi_uc* data_of(std::string_view bytes) { return reinterpret_cast<const stbi_uc*>(bytes.data()); }

/// A .tga has no mark at its start, so anything that is nothing else would pass for one but for its name. Its second byte
/// is 0 or 1, as that of no other kind is: else the decoder would find another kind by marks of its own.
bool is_supported(std::string_view bytes, std::string_view name) {
    if (bytes.starts_with("\x89PNG") || bytes.starts_with("\xff\xd8\xff") || bytes.starts_with("BM"))
        return true;
    return (name.ends_with(".tga") || name.ends_with(".TGA")) && bytes.size() > 2 && bytes[1] >= 0 &&
           bytes[1] <= 1;
}

Error broken(std::string_view name) {
    const char* reason = stbi_failure_reason();
    return bad_input(
        fmt::format("{}: the picture is broken ({}).", name, reason ? reason : "no reason given"));
}

/// What a format can do at most, of one colour all over: .png one bit per pixel, deflated by 1032; .jpg one bit per 8 x 8
/// pixels; .bmp one bit per pixel; .hdr and .tga runs of 127 and 128.
std::size_t most_pixels_per_byte(std::string_view bytes) {
    if (bytes.starts_with("\x89PNG")) return 8 * 1032;
    if (bytes.starts_with("\xff\xd8\xff")) return 8 * 64;
    if (bytes.starts_with("BM")) return 8;
    return is_rgbe(bytes) ? 16 : 64;
}

/// The decoders of .tga and .hdr take zeros for what is missing: twenty bytes would become a picture of any size.
Result<void> check_enough_bytes(const PictureInfo& info, std::string_view bytes, std::string_view name) {
    const std::size_t pixels = std::size_t(info.width) * std::size_t(info.height);
    if (pixels / most_pixels_per_byte(bytes) <= bytes.size()) return {};
    return bad_input(
        fmt::format("{}: says it has {}x{} pixels, which its {} bytes cannot hold; it is cut short.", name,
                    info.width, info.height, bytes.size()));
}

/// Size and channels, and a budget on this thread for decoding that much. Per pixel: 16 bytes of result, and the same
/// three times over for what decoders hold meanwhile; per byte of the file: gathering it from its pieces.
Result<PictureInfo> prepare(std::string_view bytes, std::string_view name) {
    if (bytes.size() > INT_MAX)
        return bad_input(fmt::format("{}: a picture of over 2 GiB is not read.", name));
    if (bytes.starts_with("\xff\xd8\xff") && !huffman_tables_fit(bytes))
        return bad_input(
            fmt::format("{}: the picture is broken (a Huffman table has over 256 codes).", name));
    constexpr std::size_t k_bytes_per_pixel = 64, k_bytes_per_file_byte = 8, k_bytes_at_least = 1 << 20;
    t_budget_bytes = k_bytes_at_least;
    PictureInfo info;
    if (!stbi_info_from_memory(data_of(bytes), int(bytes.size()), &info.width, &info.height, &info.channels))
        return broken(name);
    if (const auto size = check_picture_size(info.width, info.height, name); !size) return size.error();
    if (const auto whole = check_enough_bytes(info, bytes, name); !whole) return whole.error();
    t_budget_bytes = k_bytes_at_least + k_bytes_per_file_byte * bytes.size() +
                     k_bytes_per_pixel * std::size_t(info.width) * std::size_t(info.height);
    return info;
}

}  // namespace

bool is_rgbe(std::string_view bytes) {
    return bytes.starts_with("#?RADIANCE") || bytes.starts_with("#?RGBE");
}

Result<Image> decode_rgbe(std::string_view bytes, std::string_view name) {
    const auto info = prepare(bytes, name);
    if (!info) return info.error();
    int width = 0, height = 0, channels = 0;
    const StbPixels<float> floats(
        stbi_loadf_from_memory(data_of(bytes), int(bytes.size()), &width, &height, &channels, 3));
    if (!floats) return broken(name);
    Image image(width, height);
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = {floats.get()[3 * i], floats.get()[3 * i + 1], floats.get()[3 * i + 2]};
    return image;
}

Result<Image8> decode_ldr(std::string_view bytes, std::string_view name) {
    if (!is_supported(bytes, name))
        return bad_input(
            fmt::format("{}: this kind of picture is not read; give .png, .jpg, .bmp or .tga.", name));
    const auto info = prepare(bytes, name);
    if (!info) return info.error();
    Image8 image;
    const StbPixels<stbi_uc> pixels(stbi_load_from_memory(data_of(bytes), int(bytes.size()), &image.width,
                                                          &image.height, &image.channels, 0));
    if (!pixels) return broken(name);
    const std::size_t size =
        std::size_t(image.width) * std::size_t(image.height) * std::size_t(image.channels);
    image.bytes.assign(pixels.get(), pixels.get() + size);
    return image;
}

Result<std::string> encode_png(const Image8& image, std::string_view name) {
    std::string bytes;
    const auto append = [](void* to, void* data, int size) {
        static_cast<std::string*>(to)->append(static_cast<const char*>(data), std::size_t(size));
    };
    if (!stbi_write_png_to_func(append, &bytes, image.width, image.height, image.channels, image.bytes.data(),
                                image.width * image.channels))
        return failed(
            fmt::format("Cannot make {}: a picture of {}x{} pixels does not fit into memory as .png.", name,
                        image.width, image.height));
    return bytes;
}

}  // namespace pathscope
