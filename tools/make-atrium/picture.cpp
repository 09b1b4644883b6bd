#include "picture.hpp"

#include <fmt/core.h>
#include <stb_image_write.h>

#include <algorithm>
#include <cmath>

#include "pathscope/core/parallel_for.hpp"
#include "pathscope/math/random.hpp"

namespace pathscope::atrium {
namespace {

float smooth_step(float low, float high, float x) {
    const float t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
    return t * t * (3 - 2 * t);
}

float fraction(float x) { return x - std::floor(x); }

int wrap(int i, int count) { return ((i % count) + count) % count; }

float lattice(int x, int y, int cells, std::uint32_t seed) {
    return to_unit_float(hash_combine(hash_combine(seed, wrap(x, cells)), wrap(y, cells)));
}

/// Grain that all stones share: their colour at p, made a little lighter or darker.
Rgb weathered(Rgb colour, Vec2 p, std::uint32_t seed, float strength) {
    const float broad = cloudy(p, 4, 5, seed), fine = noise(p, 256, seed + 9);
    return colour * (1 + strength * (1.6f * (broad - 0.5f) + 0.5f * (fine - 0.5f)));
}

float encode_srgb(float x) {
    x = std::clamp(x, 0.0f, 1.0f);
    return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f;
}

/// An ellipse's inside as a number: below 1 within.
float ellipse(Vec2 p, Vec2 centre, float angle, float half_length, float half_width) {
    const Vec2 d = p - centre;
    const float along = d.x * std::cos(angle) + d.y * std::sin(angle);
    const float across = d.y * std::cos(angle) - d.x * std::sin(angle);
    return std::hypot(along / half_length, across / half_width);
}

}  // namespace

Picture paint(int width, int height, const std::function<Rgb(Vec2)>& colour) {
    Picture picture{width, height, std::vector<Rgb>(std::size_t(width) * height)};
    parallel_for(height, 0, [&](int y) {
        for (int x = 0; x < width; ++x)
            picture.pixels[std::size_t(y) * width + x] =
                colour({(float(x) + 0.5f) / float(width), 1 - (float(y) + 0.5f) / float(height)});
    });
    return picture;
}

Result<void> write_png(const std::filesystem::path& path, const Picture& picture, PictureKind kind) {
    const bool grey = kind == PictureKind::mask;
    std::vector<std::uint8_t> bytes;
    const auto to_byte = [](float x) { return std::uint8_t(std::lround(255 * x)); };
    for (const Rgb c : picture.pixels) {
        if (grey)
            bytes.push_back(to_byte(std::clamp(c.x, 0.0f, 1.0f)));
        else
            for (const float x : {c.x, c.y, c.z}) bytes.push_back(to_byte(encode_srgb(x)));
    }
    const int channels = grey ? 1 : 3;
    if (stbi_write_png(path.c_str(), picture.width, picture.height, channels, bytes.data(),
                       picture.width * channels) == 0)
        return bad_input(fmt::format("{}: cannot be written; give a folder that can be", path.string()));
    return {};
}

float noise(Vec2 p, int cells, std::uint32_t seed) {
    const float x = p.x * float(cells), y = p.y * float(cells);
    const int ix = int(std::floor(x)), iy = int(std::floor(y));
    const float tx = smooth_step(0, 1, x - float(ix)), ty = smooth_step(0, 1, y - float(iy));
    return lerp(lerp(lattice(ix, iy, cells, seed), lattice(ix + 1, iy, cells, seed), tx),
                lerp(lattice(ix, iy + 1, cells, seed), lattice(ix + 1, iy + 1, cells, seed), tx), ty);
}

float cloudy(Vec2 p, int cells, int octaves, std::uint32_t seed) {
    float sum = 0, weight = 0, share = 1;
    for (int i = 0; i < octaves; ++i, share *= 0.5f, cells *= 2) {
        sum += share * noise(p, cells, seed + std::uint32_t(i));
        weight += share;
    }
    return sum / weight;
}

Rgb limestone_blocks(Vec2 p) {
    constexpr int k_courses = 5, k_blocks = 3;
    const int course = int(std::floor(p.y * k_courses));
    const float shift = (course % 2) * 0.5f + 0.2f * lattice(0, course, k_courses, 11);
    const float along = p.x * k_blocks + shift;
    const int block = int(std::floor(along));
    const float joint =
        std::min(std::min(fraction(along), 1 - fraction(along)) / k_blocks,
                 std::min(fraction(p.y * k_courses), 1 - fraction(p.y * k_courses)) / k_courses);
    const float tone = lattice(wrap(block, k_blocks), course, 64, 12);
    const Rgb stone = lerp(Rgb{0.60f, 0.50f, 0.37f}, Rgb{0.73f, 0.64f, 0.50f}, tone);
    return weathered(lerp(Rgb{0.36f, 0.30f, 0.23f}, stone, smooth_step(0.002f, 0.006f, joint)), p, 13, 0.22f);
}

Rgb ochre_plaster(Vec2 p) {
    const float stain = cloudy(p, 3, 6, 21);
    const Rgb colour =
        lerp(Rgb{0.60f, 0.36f, 0.18f}, Rgb{0.76f, 0.55f, 0.33f}, smooth_step(0.3f, 0.7f, stain));
    return weathered(colour, p, 31, 0.12f);
}

Rgb veined_marble(Vec2 p) {
    const Vec2 bent = p + 0.18f * Vec2{cloudy(p, 4, 5, 41) - 0.5f, cloudy(p, 4, 5, 47) - 0.5f};
    // A vein is where a noise crosses one half.
    const auto vein = [&](int cells, std::uint32_t seed, float width) {
        return 1 - smooth_step(0, width, std::abs(cloudy(bent, cells, 3, seed) - 0.5f));
    };
    const float dark = std::max(vein(3, 53, 0.025f), 0.5f * vein(7, 59, 0.02f));
    const Rgb ground = lerp(Rgb{0.78f, 0.75f, 0.70f}, Rgb{0.86f, 0.84f, 0.80f}, cloudy(p, 5, 4, 61));
    return lerp(ground, Rgb{0.42f, 0.40f, 0.39f}, 0.75f * dark);
}

Rgb flagstones(Vec2 p) {
    constexpr int k_rows = 6, k_stones = 4;
    const int row = int(std::floor(p.y * k_rows));
    const float along = p.x * k_stones + lattice(1, row, k_rows, 71);
    const int stone = wrap(int(std::floor(along)), k_stones);
    const float joint = std::min(std::min(fraction(along), 1 - fraction(along)) / k_stones,
                                 std::min(fraction(p.y * k_rows), 1 - fraction(p.y * k_rows)) / k_rows);
    const Rgb tone = lerp(Rgb{0.36f, 0.30f, 0.25f}, Rgb{0.55f, 0.48f, 0.40f}, lattice(stone, row, 64, 73));
    return weathered(lerp(Rgb{0.17f, 0.15f, 0.13f}, tone, smooth_step(0.001f, 0.004f, joint)), p, 79, 0.25f);
}

Rgb inlaid_floor(Vec2 p) {
    const Rgb cream{0.72f, 0.66f, 0.55f}, green{0.06f, 0.13f, 0.10f}, red{0.30f, 0.07f, 0.05f};
    const Vec2 q{std::abs(p.x - 0.5f), std::abs(p.y - 0.5f)};
    const float square = std::max(q.x, q.y), diamond = q.x + q.y, round = std::hypot(q.x, q.y);
    Rgb colour = cream;
    if (square > 0.47f) colour = green;
    if (square < 0.43f && diamond > 0.5f) colour = red;
    if (diamond < 0.44f && diamond > 0.40f) colour = green;
    if (round < 0.24f) colour = red;
    if (round < 0.21f) {
        const int sector = int(std::floor((std::atan2(p.y - 0.5f, p.x - 0.5f) / k_pi + 1) * 8));
        colour = (sector + (round < 0.11f ? 1 : 0)) % 2 == 0 ? cream : green;
    }
    return weathered(colour, p, 83, 0.3f);
}

Rgb terracotta(Vec2 p) { return weathered({0.52f, 0.20f, 0.10f}, p, 91, 0.35f); }

Rgb oak(Vec2 p) {
    constexpr int k_planks = 5;
    const float across = p.x * k_planks;
    const int plank = wrap(int(std::floor(across)), k_planks);
    const float gap = std::min(fraction(across), 1 - fraction(across));
    const float rings =
        cloudy({p.x + 0.15f * cloudy(p, 2, 3, 101), p.y / 8 + 0.37f * float(plank)}, 24, 3, 103);
    const Rgb wood = lerp(Rgb{0.13f, 0.06f, 0.03f}, Rgb{0.30f, 0.16f, 0.08f}, rings);
    return wood * (0.75f + 0.5f * lattice(plank, 0, k_planks, 107)) * smooth_step(0.0f, 0.04f, gap);
}

Rgb damask(Vec2 p, Rgb ground, Rgb thread) {
    const float edge = std::min(std::min(p.x, 1 - p.x), 0.5f * std::min(p.y, 1 - p.y));
    const auto weave = [&](Rgb c) { return c * (0.85f + 0.3f * noise(p, 512, 113)); };
    if (edge > 0.05f && edge < 0.09f) return weave(thread);
    if (edge > 0.105f && edge < 0.115f) return weave(thread);
    if (edge < 0.115f) return weave(ground);
    // Lozenges with a flower in each, every other row shifted by half.
    const float row = p.y * 10;
    const float x = fraction(p.x * 4 + 0.5f * float(int(std::floor(row)) % 2)) - 0.5f,
                y = fraction(row) - 0.5f;
    const float angle = std::atan2(y, x), radius = std::hypot(x, y);
    const bool flower = radius < 0.17f + 0.1f * std::cos(6 * angle);
    const bool ring = std::abs(std::abs(x) + std::abs(y) - 0.46f) < 0.035f;
    return weave(flower || ring ? lerp(ground, thread, 0.75f) : ground);
}

Rgb leaves(Vec2 p) {
    const float tone = cloudy(p, 6, 4, 127);
    return lerp(Rgb{0.05f, 0.13f, 0.02f}, Rgb{0.19f, 0.31f, 0.06f}, smooth_step(0.25f, 0.75f, tone));
}

float leaf_mask(Vec2 p) {
    float inside = std::abs(p.x - 0.5f) < 0.012f && p.y < 0.8f ? 0.0f : 2.0f;  // the stalk
    inside = std::min(inside, ellipse(p, {0.5f, 0.84f}, 0.5f * k_pi, 0.15f, 0.07f));
    for (int pair = 0; pair < 4; ++pair)
        for (const float side : {-1.0f, 1.0f}) {
            const float angle = 0.5f * k_pi - side * 0.95f, y = 0.12f + 0.17f * float(pair);
            const float reach = 0.23f - 0.015f * float(pair);
            const Vec2 centre{0.5f + reach * std::cos(angle), y + reach * std::sin(angle)};
            inside = std::min(inside, ellipse(p, centre, angle, 0.21f, 0.075f));
        }
    return inside < 1 ? 1.0f : 0.0f;
}

float ivy_mask(Vec2 p) {
    const float x = p.x - 0.5f, y = p.y - 0.42f;
    const float angle = std::atan2(x, y);  // from the tip
    const float lobes = 0.31f + 0.13f * std::cos(5 * angle) * (0.6f + 0.4f * std::cos(angle));
    const bool stalk = std::abs(x) < 0.02f && y < 0 && y > -0.42f;
    return std::hypot(x, y) < lobes || stalk ? 1.0f : 0.0f;
}

float grille_mask(Vec2 p) {
    const float x = fraction(p.x * 4) - 0.5f, y = fraction(p.y * 4) - 0.5f;
    const bool bar = std::abs(x) > 0.46f || std::abs(y) > 0.47f;
    const bool ring = std::abs(std::hypot(x, y) - 0.30f) < 0.035f;
    const bool lozenge = std::abs(std::abs(x) + std::abs(y) - 0.47f) < 0.035f;
    return bar || ring || lozenge ? 1.0f : 0.0f;
}

}  // namespace pathscope::atrium
