#include "pathscope/image/image.hpp"

#include <algorithm>

namespace pathscope {
namespace {

template <class Picture>
Picture crop_picture(const Picture& picture, PixelRect rect) {
    CHECK(picture.rect().contains(rect), rect, picture.rect());
    Picture part(rect.width, rect.height);
    for (int y = 0; y < rect.height; ++y) {
        const auto from = picture.row(rect.y + y).subspan(std::size_t(rect.x), std::size_t(rect.width));
        std::copy(from.begin(), from.end(), part.row(y).begin());
    }
    return part;
}

template <class Picture>
void paste_picture(Picture& picture, const Picture& part, int x, int y) {
    const PixelRect target{x, y, part.width, part.height};
    CHECK(picture.rect().contains(target), target, picture.rect());
    for (int row = 0; row < part.height; ++row) {
        const auto from = part.row(row);
        std::copy(from.begin(), from.end(), picture.row(y + row).begin() + x);
    }
}

}  // namespace

Image crop(const Image& image, PixelRect rect) { return crop_picture(image, rect); }
Plane crop(const Plane& plane, PixelRect rect) { return crop_picture(plane, rect); }
void paste(Image& image, const Image& part, int x, int y) { paste_picture(image, part, x, y); }
void paste(Plane& plane, const Plane& part, int x, int y) { paste_picture(plane, part, x, y); }

}  // namespace pathscope
