/// What can be moved: fountain, spheres, vases, trees, ivy, banners.
#include <cmath>

#include "model.hpp"
#include "pathscope/math/frame.hpp"
#include "pathscope/math/random.hpp"

namespace pathscope::atrium {
namespace {

Vec3 random_direction(HashRng& random) {
    const float z = 2 * random.next_float() - 1, angle = 2 * k_pi * random.next_float();
    const float r = std::sqrt(std::max(0.0f, 1 - z * z));
    return {r * std::cos(angle), r * std::sin(angle), z};
}

float between(HashRng& random, float low, float high) { return lerp(low, high, random.next_float()); }

/// A card that faces `normal`, turned about it at random.
void add_leaf(Shape& to, HashRng& random, Vec3 centre, Vec3 normal, float size) {
    const Frame frame = Frame::around(normalize(normal));
    const float angle = 2 * k_pi * random.next_float(), c = std::cos(angle), s = std::sin(angle);
    add_card(to, centre, size * (c * frame.tangent + s * frame.bitangent),
             size * (c * frame.bitangent - s * frame.tangent));
}

// --- In the middle of the court

/// A sculpture that turns on itself: the (2, 3) torus knot.
Vec3 knot(float t) {
    const float a = 2 * k_pi * t, r = 0.46f + 0.2f * std::cos(3 * a);
    return {r * std::cos(2 * a), 0.30f * std::sin(3 * a), r * std::sin(2 * a)};
}

void add_fountain(Model& model, Vec3 at) {
    const Placement place{.origin = at};
    model.add(Stuff::limestone,
              lathe({{2.2f, 0},
                     {2.2f, 0.12f},
                     {2.0f, 0.16f},
                     {1.85f, 0.18f},
                     {1.80f, 0.24f},
                     {1.80f, 0.46f},
                     {1.90f, 0.52f},
                     {1.98f, 0.55f},
                     {2.0f, 0.6f},
                     {1.98f, 0.65f},
                     {1.66f, 0.65f},
                     {1.63f, 0.62f},
                     {1.62f, 0.2f},
                     {0, 0.2f}},
                    72),
              place);
    // Water stands in the basin; its side and bottom lie within the stone. Rings run out from the middle.
    std::vector<ProfilePoint> water{{0, 0.15f}, {1.7f, 0.15f}, {1.7f, 0.52f}};
    for (int i = 34; i >= 0; --i) {
        const float r = 0.05f * float(i);
        water.push_back({r, 0.52f + 0.004f * std::cos(22 * r) * std::exp(-0.5f * r)});
    }
    model.add(Stuff::water, lathe(water, 48), place);
    model.add(Stuff::marble,
              lathe({{0.34f, 0.2f},
                     {0.34f, 0.56f},
                     {0.22f, 0.62f},
                     {0.15f, 0.74f},
                     {0.19f, 0.92f},
                     {0.26f, 1.02f},
                     {0.20f, 1.12f},
                     {0.24f, 1.16f},
                     {0.55f, 1.22f},
                     {0.80f, 1.34f},
                     {0.92f, 1.47f},
                     {0.95f, 1.52f},
                     {0.91f, 1.53f},
                     {0.72f, 1.42f},
                     {0.40f, 1.36f},
                     {0.20f, 1.40f},
                     {0.18f, 1.56f},
                     {0.12f, 1.60f},
                     {0, 1.60f}},
                    56),
              place);
    // The knot stands upright on the bowl.
    const auto upright = [](float t) {
        const Vec3 p = knot(t);
        return Vec3{p.x, 2.24f + p.z, p.y};
    };
    model.add(Stuff::bronze, closed_tube(upright, 0.085f, 256, 16), place);
}

void add_sphere_on_plinth(Model& model, Stuff stuff, Vec3 at, float radius) {
    const Placement place{.origin = at};
    model.add(Stuff::marble, box({-0.34f, 0, -0.34f}, {0.34f, 0.1f, 0.34f}, 0.02f), place);
    model.add(Stuff::marble, box({-0.27f, 0.1f, -0.27f}, {0.27f, 0.72f, 0.27f}, 0.015f), place);
    model.add(Stuff::marble, box({-0.34f, 0.72f, -0.34f}, {0.34f, 0.80f, 0.34f}, 0.025f), place);
    model.add(Stuff::brass, lathe({{0.15f, 0.80f}, {0.14f, 0.83f}, {0.12f, 0.845f}}, 32), place);
    model.add(stuff, ball(radius, 56), moved(place, {0, 0.83f + radius, 0}));
}

void add_vase(Model& model, Stuff stuff, Vec3 at, float height) {
    const std::vector<ProfilePoint> outline{
        {0, 0},        {0.13f, 0},     {0.14f, 0.02f}, {0.15f, 0.05f}, {0.22f, 0.18f},  {0.28f, 0.34f},
        {0.31f, 0.5f}, {0.29f, 0.65f}, {0.22f, 0.78f}, {0.14f, 0.87f}, {0.125f, 0.92f}, {0.15f, 0.97f},
        {0.19f, 1.0f}, {0.175f, 1.0f}, {0.11f, 0.93f}, {0.12f, 0.85f}, {0.10f, 0.7f},   {0, 0.7f}};
    model.add(stuff, lathe(outline, 48), {.origin = at, .scale = {height, height, height}});
}

void add_bench(Model& model, Vec3 at, float turn) {
    const Placement place{.origin = at, .turn = turn};
    for (const float x : {-0.65f, 0.65f})
        model.add(Stuff::limestone, box({x - 0.1f, 0, -0.2f}, {x + 0.1f, 0.4f, 0.2f}, 0.015f), place);
    model.add(Stuff::marble, box({-0.95f, 0.4f, -0.26f}, {0.95f, 0.48f, 0.26f}, 0.02f), place);
}

// --- Plants

void add_tree(Model& model, Vec3 at, std::uint32_t seed) {
    const Placement place{.origin = at};
    model.add(Stuff::terracotta,
              lathe({{0, 0},
                     {0.26f, 0},
                     {0.28f, 0.03f},
                     {0.38f, 0.5f},
                     {0.40f, 0.55f},
                     {0.44f, 0.56f},
                     {0.45f, 0.62f},
                     {0.44f, 0.66f},
                     {0.38f, 0.66f},
                     {0.37f, 0.55f}},
                    40),
              place);
    model.add(Stuff::soil, lathe({{0.39f, 0.58f}, {0, 0.62f}}, 24), place);
    model.add(Stuff::bark,
              lathe({{0.06f, 0.55f}, {0.045f, 0.7f}, {0.04f, 1.2f}, {0.05f, 1.5f}, {0.02f, 1.9f}}, 12),
              place);
    HashRng random(seed);
    Shape crown;
    for (int i = 0; i < 900; ++i) {
        const Vec3 out = random_direction(random);
        const float depth = std::cbrt(between(random, 0.35f, 1.0f));
        const Vec3 centre = Vec3{0, 2.0f, 0} + 0.72f * depth * out * Vec3{1, 0.95f, 1};
        add_leaf(crown, random, centre, out + 0.9f * random_direction(random), between(random, 0.16f, 0.3f));
    }
    model.add(Stuff::leaf, crown, place);
}

/// Ivy that climbs the wall over a column, spreads below the upper floor and hangs over the balustrade.
void add_ivy(Model& model, const Placement& bay, std::uint32_t seed) {
    HashRng random(seed);
    Shape ivy;
    for (int stem = 0; stem < 13; ++stem) {
        Vec3 p{-k_bay / 2 + between(random, -0.2f, 0.2f), k_lower_floor, 0.3f};
        const float top = between(random, 3.6f, 6.9f);
        float drift = 0;
        while (p.y < top) {
            drift = 0.8f * drift + between(random, -0.05f, 0.05f);
            const float spread = p.y > k_lower_spring ? 1.6f : 0.4f;
            p.x += spread * drift;
            p.y += 0.06f;
            // It keeps to the wall's face, to the column below it, and to the string course above.
            const float wall = p.y < k_lower_spring ? 0.24f : p.y < k_upper_floor - 0.4f ? 0.27f : 0.44f;
            if (p.y < k_lower_spring) p.x += 0.3f * (-k_bay / 2 - p.x);
            p.z = wall + between(random, 0.0f, 0.05f);
            for (int leaf = 0; leaf < 2; ++leaf)
                add_leaf(ivy, random, p + Vec3{between(random, -0.12f, 0.12f), 0, between(random, 0, 0.04f)},
                         Vec3{0, 0.35f, 1} + 0.7f * random_direction(random), between(random, 0.10f, 0.21f));
        }
    }
    model.add(Stuff::ivy, ivy, bay);
}

/// A trailing plant in a trough on the balustrade.
void add_trailing_plant(Model& model, const Placement& bay, std::uint32_t seed) {
    model.add(Stuff::terracotta,
              box({-0.8f, k_upper_floor + 0.96f, -0.12f}, {0.8f, k_upper_floor + 1.2f, 0.12f}, 0.02f), bay);
    HashRng random(seed);
    Shape plant;
    for (int strand = 0; strand < 46; ++strand) {
        const float x = between(random, -0.78f, 0.78f), fall = between(random, 0.2f, 1.5f),
                    out = between(random, 0.16f, 0.3f);
        for (float s = 0; s < fall; s += 0.05f) {
            const float over = std::min(1.0f, s / 0.25f);
            const Vec3 p{x + 0.06f * std::sin(9 * s + x * 40),
                         k_upper_floor + 1.24f + 0.08f * std::sin(k_pi * over) - std::max(0.0f, s - 0.2f),
                         lerp(0.02f, out, over)};
            add_leaf(plant, random, p, Vec3{0, 0.5f, 0.8f} + random_direction(random),
                     between(random, 0.07f, 0.15f));
        }
    }
    model.add(Stuff::ivy, plant, bay);
}

// --- Cloth

/// A banner over the upper rail, in folds that grow towards its free end.
void add_banner(Model& model, Stuff stuff, const Placement& column, float phase) {
    constexpr float k_half_width = 0.55f, k_top = k_upper_floor + 0.98f, k_length = 3.1f;
    const auto cloth = [=](float u, float v) {
        const float down = 1 - v;  // v = 1 at the rail, so that the picture hangs upright
        const float fold =
            0.075f * down * std::sin(2 * k_pi * 2.5f * u + phase) + 0.03f * down * std::sin(5 * down + phase);
        const float narrow = 1 - 0.08f * down;
        return Vec3{(2 * u - 1) * k_half_width * narrow, k_top - k_length * down, 0.5f + fold};
    };
    model.add(stuff, sheet(24, 32, {1, 1}, cloth), column);
    model.add(Stuff::brass, box({-0.65f, k_top - 0.02f, 0.3f}, {0.65f, k_top + 0.02f, 0.52f}, 0.01f), column);
}

}  // namespace

void furnish(Model& model) {
    add_fountain(model, {0, 0, -1});
    add_sphere_on_plinth(model, Stuff::mirror, {3.3f, 0, 7.0f}, 0.42f);
    add_sphere_on_plinth(model, Stuff::glass, {1.5f, 0, 8.2f}, 0.36f);
    add_vase(model, Stuff::glaze, {4.6f, 0, 8.6f}, 1.15f);
    add_vase(model, Stuff::brass, {5.3f, 0, 9.3f}, 0.75f);
    add_vase(model, Stuff::glaze, {-4.7f, 0, 1.0f}, 1.0f);
    add_bench(model, {5.4f, 0, 4.2f}, 0.5f * k_pi);
    add_bench(model, {-5.4f, 0, -1.4f}, 0.5f * k_pi);

    std::uint32_t seed = 1;
    for (const float z : {-10.5f, -6.0f, 5.0f})
        for (const float x : {-4.6f, 4.6f}) add_tree(model, {x, 0, z}, seed++);
    for (const Bay& bay : all_bays()) {
        const bool long_side = bay.side % 2 == 1;
        const Placement column = moved(bay.place, {-k_bay / 2, 0, 0});
        if (long_side && bay.index % 3 == 1) add_ivy(model, bay.place, 100 + seed++);
        if (bay.index % 3 == (long_side ? 2 : 1)) add_trailing_plant(model, bay.place, 200 + seed++);
        if (long_side && bay.index % 3 == 0 && bay.index > 0)
            add_banner(model, bay.index % 2 == 0 ? Stuff::banner_blue : Stuff::banner_red, column,
                       float(bay.index));
    }
}

}  // namespace pathscope::atrium
