#include "pathscope/image/image_hash.hpp"

#include <bit>
#include <cstdint>

namespace pathscope {

static_assert(std::endian::native == std::endian::little, "The hash is defined on little-endian bytes.");
static_assert(sizeof(Rgb) == 3 * sizeof(float), "Pixels are hashed as they lie in memory.");

Digest image_hash(const Image& image) {
    Hasher hasher;
    const std::uint32_t size[2] = {std::uint32_t(image.width), std::uint32_t(image.height)};
    hasher.add(std::as_bytes(std::span(size)));
    hasher.add(std::as_bytes(std::span(image.pixels)));
    return hasher.finish();
}

}  // namespace pathscope
