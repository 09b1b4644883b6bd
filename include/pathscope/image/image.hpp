#pragma once
/// Rasters: a rectangle of pixels in memory, row by row, top row first.
///
///   pixel (x, y) is pixels[y * width + x];  x grows to the right, y grows downwards
///
/// Why: every buffer of the renderer (light, guides, counts) has this one layout, so that hashing, filtering,
/// saving and showing need no cases. Units: an Image holds linear radiance (or albedo, or a normal) as Rgb, a
/// Plane holds one float per pixel (depth, samples, variance). Ensures: pixels.size() == width * height, as
/// long as nobody changes one without the others. Thread safety: values; different pixels may be written from
/// different threads.   Test: tests/image/test_image.cpp

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "pathscope/core/check.hpp"
#include "pathscope/image/block.hpp"
#include "pathscope/math/vec.hpp"

namespace pathscope {

template <class Pixel>
struct Raster {
    int width = 0;
    int height = 0;
    std::vector<Pixel> pixels;

    Raster() = default;
    /// Requires: width, height >= 0.
    Raster(int raster_width, int raster_height, Pixel fill = {})
        : width(raster_width), height(raster_height) {
        CHECK(width >= 0 && height >= 0, width, height);
        pixels.assign(std::size_t(width) * std::size_t(height), fill);
    }
    /// Requires: as many values as pixels.
    Raster(int raster_width, int raster_height, std::vector<Pixel> values)
        : width(raster_width), height(raster_height), pixels(std::move(values)) {
        CHECK(width >= 0 && height >= 0 && pixels.size() == std::size_t(width) * std::size_t(height), width,
              height, pixels.size());
    }

    [[nodiscard]] bool empty() const { return pixels.empty(); }
    [[nodiscard]] PixelRect rect() const { return {0, 0, width, height}; }

    /// Requires: (x, y) lies in the raster. Loops over many pixels take row() instead.
    [[nodiscard]] Pixel& at(int x, int y) { return pixels[index(x, y)]; }
    [[nodiscard]] const Pixel& at(int x, int y) const { return pixels[index(x, y)]; }

    /// Requires: 0 <= y < height.
    [[nodiscard]] std::span<Pixel> row(int y) { return {&pixels[index(0, y)], std::size_t(width)}; }
    [[nodiscard]] std::span<const Pixel> row(int y) const {
        return {&pixels[index(0, y)], std::size_t(width)};
    }

    friend bool operator==(const Raster&, const Raster&) = default;

  private:
    [[nodiscard]] std::size_t index(int x, int y) const {
        CHECK(rect().contains(x, y), x, y, width, height);
        return std::size_t(y) * std::size_t(width) + std::size_t(x);
    }
};

struct Image : Raster<Rgb> {
    using Raster::Raster;
};

struct Plane : Raster<float> {
    using Raster::Raster;
};

/// The pixels of `rect` as a picture of their own. Requires: rect lies in the picture.
[[nodiscard]] Image crop(const Image& image, PixelRect rect);
[[nodiscard]] Plane crop(const Plane& plane, PixelRect rect);

/// Copies `part` into `image`, its corner at (x, y). Requires: it fits.
void paste(Image& image, const Image& part, int x, int y);
void paste(Plane& plane, const Plane& part, int x, int y);

/// Eight bits per channel, as files hold them: `channels` bytes per pixel, top row first, in whatever
/// encoding the file has (colours nearly always sRGB; see decode_srgb8 in tonemap.hpp).
struct Image8 {
    int width = 0;
    int height = 0;
    int channels = 0;                 ///< 1 grey, 2 grey + alpha, 3 RGB, 4 RGB + alpha.
    std::vector<std::uint8_t> bytes;  ///< width * height * channels.
};

}  // namespace pathscope
