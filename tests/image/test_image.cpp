#include "pathscope/image/image.hpp"

#include "testing.hpp"

using namespace pathscope;

TEST_CASE("pixels lie row by row, top row first") {
    Image image(3, 2);
    image.at(2, 0) = {1, 2, 3};
    image.at(0, 1) = {4, 5, 6};
    CHECK(image.pixels[2] == Rgb{1, 2, 3});
    CHECK(image.pixels[3] == Rgb{4, 5, 6});
    CHECK(image.row(1).size() == 3);
    CHECK(image.row(1)[0] == Rgb{4, 5, 6});
    CHECK(Plane(2, 2, 7.0f).pixels == std::vector<float>(4, 7.0f));
    CHECK(Image{}.empty());
}

TEST_CASE("crop takes a rectangle out, paste puts it back") {
    Plane numbered(5, 4);
    for (int i = 0; i < 20; ++i) numbered.pixels[std::size_t(i)] = float(i);

    const PixelRect rect{1, 2, 3, 2};
    const Plane part = crop(numbered, rect);
    CHECK(part == Plane(3, 2, {11, 12, 13, 16, 17, 18}));

    Plane target(5, 4, -1.0f);
    paste(target, part, rect.x, rect.y);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 5; ++x) CHECK(target.at(x, y) == (rect.contains(x, y) ? numbered.at(x, y) : -1));
    CHECK(crop(numbered, numbered.rect()) == numbered);
}
