#include "pathscope/image/image_hash.hpp"

#include <cstring>
#include <set>
#include <string>

#include "testing.hpp"

using namespace pathscope;

namespace {

void append_little_endian(std::string& bytes, std::uint32_t value) {
    for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>((value >> shift) & 255);
}

void append_float(std::string& bytes, float value) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    append_little_endian(bytes, bits);
}

}  // namespace

TEST_CASE("the hash is that of width, height and the floats, written out byte by byte") {
    const Image image(2, 3, {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {0.1f, -0.0f, 1e30f}, {0, 0, 0}, {1, 1, 1}});
    std::string bytes;
    append_little_endian(bytes, 2);
    append_little_endian(bytes, 3);
    for (const Rgb pixel : image.pixels)
        for (int c = 0; c < 3; ++c) append_float(bytes, pixel[c]);
    CHECK(image_hash(image) == hash_text(bytes));
}

TEST_CASE("size, place, sign of zero and the last bit all count") {
    const Image image(2, 1, {{1, 0, 3}, {4, 5, 6}});
    Image last_bit = image, sign = image, swapped = image;
    last_bit.pixels[1].z = std::nextafter(6.0f, 7.0f);
    sign.pixels[0].y = -0.0f;
    std::swap(swapped.pixels[0], swapped.pixels[1]);
    const std::set<std::string> hashes{
        to_hex(image_hash(image)),    to_hex(image_hash(Image(1, 2, image.pixels))),
        to_hex(image_hash(last_bit)), to_hex(image_hash(sign)),
        to_hex(image_hash(swapped)),  to_hex(image_hash(Image{}))};
    CHECK(hashes.size() == 6);
    CHECK(image_hash(Image(image)) == image_hash(image));
}
