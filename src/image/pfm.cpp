/// Portable float map: "PF\n<width> <height>\n<scale>\n", then R, G, B floats, bottom row first. A negative scale says
/// little endian; its size is ignored, as everybody does. "Pf" is the same with one channel.
/// Source: P. Debevec, "The PFM Portable FloatMap Image Format", https://www.pauldebevec.com/Research/HDR/PFM/

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>

#include "formats.hpp"

namespace pathscope {
namespace {

static_assert(std::endian::native == std::endian::little && sizeof(Rgb) == 12,
              "Pixels are copied as they lie in memory.");

bool is_space(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }

/// Takes the next word, and the one character of white space after it, off the front of `rest`.
std::string_view take_word(std::string_view& rest) {
    while (!rest.empty() && is_space(rest.front())) rest.remove_prefix(1);
    const auto end = std::find_if(rest.begin(), rest.end(), is_space);
    const std::string_view word = rest.substr(0, std::size_t(end - rest.begin()));
    rest.remove_prefix(std::min(word.size() + 1, rest.size()));
    return word;
}

template <class Number>
bool parse(std::string_view word, Number& number) {
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    return error == std::errc{} && end == word.data() + word.size();
}

float float_at(const char* bytes, bool swap) {
    std::uint32_t bits;
    std::memcpy(&bits, bytes, sizeof bits);
    return std::bit_cast<float>(swap ? __builtin_bswap32(bits) : bits);
}

}  // namespace

bool is_pfm(std::string_view bytes) {
    return bytes.size() > 2 && bytes[0] == 'P' && (bytes[1] == 'F' || bytes[1] == 'f') && is_space(bytes[2]);
}

std::string encode_pfm(const Image& image) {
    std::string bytes = fmt::format("PF\n{} {}\n-1.0\n", image.width, image.height);
    bytes.reserve(bytes.size() + image.pixels.size() * sizeof(Rgb));
    for (int y = image.height - 1; y >= 0; --y) {
        const auto row = std::as_bytes(image.row(y));
        bytes.append(reinterpret_cast<const char*>(row.data()), row.size());
    }
    return bytes;
}

Result<Image> decode_pfm(std::string_view bytes, std::string_view name) {
    std::string_view rest = bytes;
    const std::size_t channels = take_word(rest) == "PF" ? 3 : 1;
    int width = 0, height = 0;
    double scale = 0;
    if (!parse(take_word(rest), width) || !parse(take_word(rest), height) || !parse(take_word(rest), scale) ||
        !(scale < 0 || scale > 0))
        return bad_input(fmt::format("{}: the head of a .pfm must be PF, width, height and scale.", name));
    if (const auto size = check_picture_size(width, height, name); !size) return size.error();

    const std::size_t row_bytes = std::size_t(width) * channels * sizeof(float);
    if (rest.size() != row_bytes * std::size_t(height))
        return bad_input(fmt::format("{}: holds {} bytes of pixels where {}x{} need {}; is it cut short?",
                                     name, rest.size(), width, height, row_bytes * std::size_t(height)));

    const bool swap = scale > 0;
    const std::size_t step = channels == 3 ? sizeof(float) : 0;
    Image image(width, height);
    for (int y = 0; y < height; ++y) {
        const char* from = rest.data() + row_bytes * std::size_t(height - 1 - y);
        for (Rgb& pixel : image.row(y)) {
            pixel = {float_at(from, swap), float_at(from + step, swap), float_at(from + 2 * step, swap)};
            from += channels * sizeof(float);
        }
    }
    return image;
}

}  // namespace pathscope
