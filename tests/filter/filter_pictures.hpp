#pragma once
/// Pictures and guides for tests of the filters.

#include <limits>

#include "pathscope/filter/joint_bilateral.hpp"
#include "pathscope/math/random.hpp"

namespace pathscope::testing {

inline constexpr float k_inf = std::numeric_limits<float>::infinity();
inline const float k_nan = std::numeric_limits<float>::quiet_NaN();

inline Image random_image(int width, int height, std::uint32_t seed) {
    HashRng rng(seed);
    Image image(width, height);
    for (Rgb& pixel : image.pixels) pixel = {rng.next_float(), rng.next_float(), 4 * rng.next_float()};
    return image;
}

inline Guides flat_guides(int width, int height) {
    return {Image(width, height, {0, 0, 1}), Image(width, height, {0.5f, 0.5f, 0.5f}),
            Plane(width, height, 3.0f)};
}

/// Guides with structure in each of the three: tilted normals, a textured albedo, sloped depth, some sky.
inline Guides random_guides(int width, int height, std::uint32_t seed) {
    HashRng rng(seed);
    Guides guides = flat_guides(width, height);
    for (std::size_t i = 0; i < guides.depth.pixels.size(); ++i) {
        const Vec3 tilt{0.3f * rng.next_float(), 0.3f * rng.next_float(), 1};
        const bool sky = rng.next_float() < 0.1f;
        guides.normal.pixels[i] = sky ? Vec3{} : normalize(tilt);
        guides.albedo.pixels[i] = {0.2f * rng.next_float(), 0.1f * rng.next_float(), 0.3f};
        guides.depth.pixels[i] = !sky ? 5 + 0.5f * rng.next_float() : rng.next_float() < 0.5f ? 0 : k_inf;
    }
    return guides;
}

}  // namespace pathscope::testing
