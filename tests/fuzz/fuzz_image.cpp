/// Pictures, as textures and environment maps are read: whatever is read has the size it says.
///
///     bytes = kind file
///
/// Left out: .exr, which the library decodes; it is not instrumented here, and fuzzed by those who make it.

#include "fuzz_input.hpp"
#include "fuzz_target.hpp"
#include "image/formats.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/image/io.hpp"

namespace pathscope::fuzz {
namespace {

void read_anything(std::string_view bytes) {
    FuzzInput in(bytes);
    const char* const name = in.flag() ? "a.tga" : "a.png";  // Only by its name a .tga is one.
    const std::string_view file = in.rest();
    if (is_exr(file)) return;
    const auto image = decode_hdr(file, name);
    if (image)
        CHECK(image->pixels.size() == std::size_t(image->width) * std::size_t(image->height), image->width);
    else
        CHECK(!image.error().message.empty());
    const auto image8 = decode_ldr(file, name);
    if (!image8) return CHECK(!image8.error().message.empty());
    CHECK(image8->channels >= 1 && image8->channels <= 4, image8->channels);
    CHECK(image8->bytes.size() ==
              std::size_t(image8->width) * std::size_t(image8->height) * std::size_t(image8->channels),
          image8->width, image8->height);
}

std::vector<std::string> seeds() {
    using namespace std::string_literals;
    Image picture(5, 3);
    Image8 screen{5, 3, 3, {}};
    for (std::size_t i = 0; i < picture.pixels.size(); ++i) picture.pixels[i] = {float(i), 0.5f, -1};
    for (int i = 0; i < 45; ++i) screen.bytes.push_back(std::uint8_t(5 * i));
    std::vector<std::string> seeds{"\0"s + encode_pfm(picture), "\0Pf\n1 1\n1.0\n"s + "\x3f\x80\0\0"s};
    if (const auto png = encode_png(screen, "a.png"); png) seeds.push_back("\0"s + *png);
    seeds.push_back("\0#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n"s +
                    "\x80\x80\x80\x81\x40\x20\x10\x82"s);
    // Headers of 2 x 1 pixels: .tga of 24 bits, the same in runs, and a .bmp.
    seeds.push_back("\1\0\0\2\0\0\0\0\0\0\0\0\0\2\0\1\0\x18\0"s + "abcdef");
    seeds.push_back("\1\0\0\xA\0\0\0\0\0\0\0\0\0\2\0\1\0\x18\0\x81"s + "abc");
    seeds.push_back("\0BM\x3e\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\2\0\0\0\1\0\0\0\1\0\x18\0"s +
                    std::string(24, '\0') + "abcdef\0\0"s);
    return seeds;
}

const FuzzTarget k_target{"image", read_anything, seeds};

}  // namespace
}  // namespace pathscope::fuzz
