#include "pathscope/image/io.hpp"

#include <bit>
#include <cstring>
#include <limits>

#include "pathscope/core/files.hpp"
#include "pathscope/image/image_hash.hpp"
#include "pathscope/math/random.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

/// Values over the whole range of floats, with those that careless writers lose.
Image random_image(int width, int height, std::uint32_t seed) {
    HashRng rng(seed);
    Image image(width, height);
    for (Rgb& pixel : image.pixels)
        pixel = {std::exp(20 * rng.next_float() - 10), -rng.next_float(), rng.next_float() * 1e30f};
    image.pixels[0] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                       -0.0f};
    image.pixels[1] = {std::numeric_limits<float>::denorm_min(), std::numeric_limits<float>::max(), 0};
    return image;
}

Plane random_plane(int width, int height, std::uint32_t seed) {
    HashRng rng(seed);
    Plane plane(width, height);
    for (float& value : plane.pixels) value = 100 * rng.next_float();
    return plane;
}

bool same_bits(const Image& a, const Image& b) { return image_hash(a) == image_hash(b); }

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

std::string saved_bytes(const std::filesystem::path& path, const Image& image) {
    REQUIRE(bool(save_image(path, image)));
    return *read_file(path);
}

/// Every way of cutting `bytes` short must be refused. Cuts one byte at a time near both ends, wide steps between.
void check_truncations(const std::string& bytes, bool refused_always) {
    for (std::size_t size = 0; size < bytes.size(); size += size < 600 || size + 64 > bytes.size() ? 1 : 17) {
        const auto image = decode_hdr(std::string_view(bytes).substr(0, size), "cut");
        if (refused_always) CHECK_FALSE(bool(image));
        if (!image) CHECK(contains(image.error().message, "cut"));
    }
}

/// Whatever is done to a file, reading it ends, with a picture or a sentence.
void check_damage(const std::string& bytes, int trials) {
    HashRng rng(5);
    for (int trial = 0; trial < trials; ++trial) {
        std::string damaged = bytes;
        for (std::uint32_t i = 0; i < 1 + trial % 4u; ++i)
            damaged[rng.next_u32() % (trial % 2 ? std::min<std::size_t>(damaged.size(), 400)
                                                : damaged.size())] = static_cast<char>(rng.next_u32());
        const auto image = decode_hdr(damaged, "damaged");
        if (image) CHECK(image->pixels.size() == std::size_t(image->width) * std::size_t(image->height));
        if (!image) CHECK(contains(image.error().message, "damaged"));
    }
}

void put_little_endian(std::string& bytes, std::size_t offset, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i) bytes[offset + i] = static_cast<char>(value >> (8 * i));
}

void put_big_endian(std::string& bytes, std::size_t offset, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i) bytes[offset + i] = static_cast<char>(value >> (24 - 8 * i));
}

}  // namespace

TEST_CASE(".pfm and .exr give back every bit") {
    const testing::TemporaryFolder folder;
    const Image image = random_image(31, 17, 1);
    for (const char* name : {"a.pfm", "a.exr", "A.EXR"}) {
        CAPTURE(name);
        REQUIRE(bool(save_image(folder.path() / name, image)));
        const auto loaded = load_image(folder.path() / name);
        REQUIRE(bool(loaded));
        CHECK(same_bits(*loaded, image));
    }
    CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) ==
          3);  // Nothing left beside.
}

TEST_CASE(".pfm: bottom row first, little endian") {
    const testing::TemporaryFolder folder;
    const std::string bytes = saved_bytes(folder.path() / "a.pfm", Image(1, 2, {{1, 2, 3}, {4, 5, 6}}));
    const std::string head = "PF\n1 2\n-1.0\n";
    REQUIRE(bytes.size() == head.size() + 24);
    CHECK(bytes.substr(0, head.size()) == head);
    CHECK(bytes.substr(head.size(), 4) == std::string("\x00\x00\x80\x40", 4));  // 4.0f of the lower row.
}

TEST_CASE(".pfm by others: big endian, one channel, Windows line ends") {
    const std::string big_endian =
        std::string("PF 1 1 1.0 ") + std::string("\x3f\x80\x00\x00\x40\x00\x00\x00\x40\x40\x00\x00", 12);
    CHECK(decode_hdr(big_endian, "x")->at(0, 0) == Rgb{1, 2, 3});
    const std::string grey =
        std::string("Pf\n1 2\n-1.0\n") + std::string("\x00\x00\x80\x3f\x00\x00\x00\x40", 8);
    CHECK(decode_hdr(grey, "x")->at(0, 0) == Rgb{2, 2, 2});
    CHECK(decode_hdr(grey, "x")->at(0, 1) == Rgb{1, 1, 1});
    CHECK(contains(decode_hdr(grey + "?", "x").error().message, "holds 9 bytes of pixels where 1x2 need 8"));
}

TEST_CASE(".exr: layers and metadata come back under their names") {
    const testing::TemporaryFolder folder;
    const auto path = folder.path() / "layers.exr";
    const Image combined = random_image(9, 7, 1), direct = random_image(9, 7, 2),
                indirect = random_image(9, 7, 3);
    const Plane depth = random_plane(9, 7, 4), spp = random_plane(9, 7, 5), red = random_plane(9, 7, 6);
    const ImageLayer layers[] = {{"combined", &combined}, {"direct", &direct}, {"bounce.indirect", &indirect},
                                 {"depth.Z", &depth},     {"spp", &spp},       {"odd.R", &red}};
    REQUIRE(bool(save_image(path, layers, {{}, {{"scene", "box"}, {"state-hash", "a b\nc"}}})));

    const auto all = load_layers(path);
    REQUIRE(bool(all));
    REQUIRE(all->images.size() == 3);
    CHECK(same_bits(all->images.at(""), combined));
    CHECK(same_bits(all->images.at("direct"), direct));
    CHECK(same_bits(all->images.at("bounce.indirect"), indirect));
    REQUIRE(all->planes.size() == 3);
    CHECK(all->planes.at("depth.Z") == depth);
    CHECK(all->planes.at("spp") == spp);
    CHECK(all->planes.at("odd.R") == red);  // An R without G and B is no picture.
    CHECK(all->metadata == Metadata{{"scene", "box"}, {"state-hash", "a b\nc"}});
    CHECK(same_bits(*load_image(path), combined));
}

TEST_CASE(".pfm and .png take the first layer") {
    const testing::TemporaryFolder folder;
    const Image first = random_image(4, 4, 1), second = random_image(4, 4, 2);
    const ImageLayer layers[] = {{"combined", &first}, {"direct", &second}};
    REQUIRE(bool(save_image(folder.path() / "a.pfm", layers)));
    CHECK(same_bits(*load_image(folder.path() / "a.pfm"), first));
}

TEST_CASE(".png holds the tone-mapped picture") {
    const testing::TemporaryFolder folder;
    const Image image = random_image(33, 21, 1);
    const ToneMapParams params{-1.5f, ToneCurve::reinhard};
    REQUIRE(bool(save_image(folder.path() / "a.png", image, {params, {}})));
    Image8 expected;
    tone_map(image, params, 3, expected);
    const auto loaded = decode_ldr(*read_file(folder.path() / "a.png"), "a.png");
    REQUIRE(bool(loaded));
    CHECK(loaded->width == 33);
    CHECK(loaded->height == 21);
    CHECK(loaded->channels == 3);
    CHECK(loaded->bytes == expected.bytes);

    const auto linear = load_image(folder.path() / "a.png");
    REQUIRE(bool(linear));
    CHECK(linear->at(5, 5).x == decode_srgb8(expected.bytes[3 * (5 * 33 + 5)]));
}

TEST_CASE(".hdr: shared exponents") {
    // value = mantissa * 2^(exponent - 136)
    const std::string bytes = std::string("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n") +
                              std::string("\x80\x40\x20\x81\x01\x02\x03\x88", 8);
    const auto image = decode_hdr(bytes, "sky.hdr");
    REQUIRE(bool(image));
    CHECK(image->at(0, 0) == Rgb{1, 0.5f, 0.25f});
    CHECK(image->at(1, 0) == Rgb{1, 2, 3});
}

TEST_CASE("names that are no pictures are refused with the three that are") {
    const testing::TemporaryFolder folder;
    for (const char* name : {"a.jpg", "a", "a.exr.txt", ".png"}) {
        const auto saved = save_image(folder.path() / name, Image(1, 1));
        REQUIRE_FALSE(bool(saved));
        CHECK(saved.error().kind == ErrorKind::bad_input);
        CHECK(contains(saved.error().message, name));
        CHECK(contains(saved.error().message, ".exr, .png or .pfm"));
        CHECK(check_writable(folder.path() / name).error().message == saved.error().message);
    }
}

TEST_CASE("check_writable finds out before the work, and leaves nothing behind") {
    const testing::TemporaryFolder folder;
    const auto good = folder.path() / "out.exr";
    CHECK(bool(check_writable(good)));
    CHECK(std::filesystem::is_empty(folder.path()));
    REQUIRE(bool(write_file_atomically(good, "old")));
    CHECK(bool(check_writable(good)));
    CHECK(*read_file(good) == "old");

    const auto missing = check_writable(folder.path() / "no" / "out.exr");
    REQUIRE_FALSE(bool(missing));
    CHECK(missing.error().kind == ErrorKind::bad_input);
    CHECK(contains(missing.error().message, "there is no folder"));
    CHECK_FALSE(bool(save_image(folder.path() / "no" / "out.exr", Image(1, 1))));

    std::filesystem::create_directory(folder.path() / "folder.png");
    CHECK(contains(check_writable(folder.path() / "folder.png").error().message, "is a folder"));
    CHECK_FALSE(bool(save_image(folder.path() / "folder.png", Image(1, 1))));
    CHECK_FALSE(bool(check_writable("/proc/out.exr")));
}

TEST_CASE("files that are missing or no pictures are refused by name") {
    const testing::TemporaryFolder folder;
    CHECK(contains(load_image(folder.path() / "none.pfm").error().message, "none.pfm"));
    CHECK(contains(load_layers(folder.path() / "none.exr").error().message, "none.exr"));
    CHECK(contains(decode_hdr("", "empty").error().message, "empty: this kind of picture is not read"));
    CHECK_FALSE(bool(decode_hdr("GIF89a\x01\x00\x01\x00", "x.gif")));
    CHECK_FALSE(bool(decode_ldr("P6 1 1 255 abc", "x.ppm")));
}

TEST_CASE("files cut short are refused") {
    const testing::TemporaryFolder folder;
    const Image image = random_image(23, 19, 7);
    check_truncations(saved_bytes(folder.path() / "a.pfm", image), true);
    check_truncations(saved_bytes(folder.path() / "a.exr", image), true);
    // A .png is whole when its pixels are: the end mark after them may be missing.
    check_truncations(saved_bytes(folder.path() / "a.png", image), false);
}

TEST_CASE("damaged files give a picture or a sentence, and nothing else") {
    const testing::TemporaryFolder folder;
    const Image image = random_image(23, 19, 8);
    const int trials = testing::k_sanitized ? 200 : 1000;
    check_damage(saved_bytes(folder.path() / "a.pfm", image), trials);
    check_damage(saved_bytes(folder.path() / "a.exr", image), trials);
    check_damage(saved_bytes(folder.path() / "a.png", image), trials);
}

TEST_CASE("files that claim to be huge are refused before memory is taken") {
    CHECK(contains(decode_hdr("PF 99999 1 -1.0 ", "x").error().message, "99999x1 pixels"));
    CHECK(contains(decode_hdr("PF 16384 16384 -1.0 ", "x").error().message, "16384x16384 pixels"));
    CHECK_FALSE(bool(decode_hdr("PF 99999999999 1 -1.0 ", "x")));
    CHECK_FALSE(bool(decode_hdr("PF -1 -1 -1.0 ", "x")));
    CHECK_FALSE(bool(decode_hdr("PF 1 1 0.0 aaaabbbbcccc", "x")));
    CHECK_FALSE(bool(decode_hdr("PF 1 1 nan aaaabbbbcccc", "x")));
    CHECK_FALSE(bool(decode_hdr("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 90000 +X 90000\n", "x")));

    const testing::TemporaryFolder folder;
    std::string png = saved_bytes(folder.path() / "a.png", Image(4, 4));
    put_big_endian(png, 16, 20000);  // The width in the IHDR chunk.
    CHECK(contains(decode_hdr(png, "x").error().message, "20000x4 pixels"));

    std::string exr = saved_bytes(folder.path() / "a.exr", Image(4, 4));
    const std::string attribute("dataWindow\0box2i\0", 17);
    const std::size_t box = exr.find(attribute) + attribute.size() + 4;  // Past its size: x, y, x, y.
    put_little_endian(exr, box + 8, 16383);
    put_little_endian(exr, box + 12, 16383);
    exr += std::string(20'000, '\0');  // Room for the table of rows, which is read first.
    CHECK(contains(decode_hdr(exr, "x").error().message, "16384x16384 pixels"));
    put_little_endian(exr, box + 8, 20000);
    CHECK_FALSE(bool(decode_hdr(exr, "x")));
}

TEST_CASE("a picture whose file could not hold it is refused before it is made up of zeros") {
    // A .tga of 24 bits: no name, no palette, this type (2 plain, 10 in runs), its sides, then pixels.
    const auto tga = [](int type, int width, int height, const std::string& pixels) {
        std::string head(18, '\0');
        head[2] = char(type);
        head[12] = char(width % 256);
        head[13] = char(width / 256);
        head[14] = char(height % 256);
        head[15] = char(height / 256);
        head[16] = 24;
        return head + pixels;
    };
    for (const int type : {2, 10}) {
        const auto refused = decode_ldr(tga(type, 11'776, 8192, "x"), "a.tga");
        REQUIRE_FALSE(bool(refused));
        CHECK(refused.error().message ==
              "a.tga: says it has 11776x8192 pixels, which its 19 bytes cannot hold; it is cut short.");
    }
    // One colour all over, 128 pixels in each run of four bytes, is what a file can do.
    std::string runs;
    for (int i = 0; i < 512; ++i)
        runs +=
            "\xff"
            "abc";
    const auto flat = decode_ldr(tga(10, 256, 256, runs), "a.tga");
    REQUIRE(bool(flat));
    CHECK(flat->bytes.size() == 3u * 256 * 256);
}

TEST_CASE("a .jpg with a Huffman table of more than 256 codes never reaches its decoder") {
    const auto segment = [](char marker, const std::string& content) {
        const std::size_t length = content.size() + 2;
        return std::string{'\xff', marker, char(length / 256), char(length % 256)} + content;
    };
    const std::string start = "\xff\xd8", scan = segment('\xda', "x") + "pixels";
    const std::string overfull = segment('\xc4', std::string(17, '\x11') + "codes");  // 16 * 17 = 272
    const std::string full = segment('\xc4', '\0' + std::string(16, '\x10') + std::string(256, 'c'));
    const std::string empty_then_overfull = segment('\xc4', std::string(17, '\0') + std::string(17, '\x11'));
    const std::string hidden = segment('\xe1', overfull);  // In metadata it means nothing.
    const auto refused = [&](const std::string& file) {
        const auto image = decode_ldr(file, "a.jpg");
        REQUIRE_FALSE(bool(image));
        return image.error().message.find("over 256 codes") != std::string::npos;
    };
    CHECK(refused(start + overfull));
    CHECK(refused(start + full + overfull));
    CHECK(refused(start + empty_then_overfull));
    CHECK(refused(start + scan + overfull));
    CHECK(refused(start + hidden + scan + overfull));
    CHECK(refused(start + overfull.substr(0, 21)));
    // The decoder sees a .jpg behind more of the first byte, too; we do not, whatever it is called.
    CHECK_FALSE(bool(decode_ldr("\xff\xff" + start + overfull, "a.tga")));
    CHECK_FALSE(refused(start + full));  // Broken in other ways.
    CHECK_FALSE(refused(start + hidden + full + scan));
}

TEST_CASE("a .png that inflates to far more than its size says is stopped") {
    // Megabytes of black in a few kB; then the head is made to promise one pixel.
    const testing::TemporaryFolder folder;
    std::string png =
        saved_bytes(folder.path() / "a.png", testing::k_sanitized ? Image(700, 700) : Image(2000, 2000));
    REQUIRE(png.size() < 200'000);
    REQUIRE(bool(decode_ldr(png, "whole")));
    put_big_endian(png, 16, 1);
    put_big_endian(png, 20, 1);
    CHECK(contains(decode_ldr(png, "bomb").error().message, "outofmem"));
    CHECK(bool(decode_ldr(*read_file(folder.path() / "a.png"), "the next one")));
}

TEST_CASE("textures of real scenes decode") {
    const auto folder = testing::shared_folder();
    if (folder.empty()) {
        MESSAGE("skipped: no ../shared");
        return;
    }
    const auto decode = [&](const char* name) {
        return decode_ldr(*read_file(folder / "scenes" / name), name);
    };
    const auto wood = decode("veach_ajar/textures/cherry-wood-texture.jpg");
    REQUIRE(bool(wood));
    CHECK(wood->channels == 3);
    CHECK(wood->bytes.size() == std::size_t(wood->width) * std::size_t(wood->height) * 3);
    for (const char* name :
         {"crytek_sponza/textures/chain_texture_mask.png", "veach_ajar/textures/checker_FloorBSDF.png",
          "dabrovic_sponza/KAMEN-bump.jpg", "crytek_sponza/textures/lion.jpg"})
        CHECK(bool(decode(name)));
}
