/// The building: floors, arcades on two floors, vaults, outer walls, roof.
#include <cmath>

#include "model.hpp"

namespace pathscope::atrium {
namespace {

constexpr float k_arch_radius = 1.15f;
constexpr float k_arcade_depth = 0.5f;

/// A box in the frame of a place, given by the middle of its foot and its size.
void block(Model& model, Stuff stuff, const Placement& place, Vec3 foot, Vec3 size, float bevel = 0.012f) {
    const Vec3 half{size.x / 2, 0, size.z / 2};
    model.add(stuff, box(foot - half, foot + half + Vec3{0, size.y, 0}, bevel), place);
}

// --- Columns

/// A leaf of a Corinthian capital: rises along the bell and curls over at its tip.
Shape capital_leaf(float foot_radius, float height) {
    return sheet(4, 5, {1, 1}, [=](float u, float v) {
        const float curl = std::max(0.0f, v - 0.6f) / 0.4f;
        const float half_width = 0.085f * std::sqrt(std::max(0.02f, 1 - v * v * 0.85f));
        const float across = (2 * u - 1) * half_width;
        const float out = foot_radius + 0.055f * v + 0.07f * curl * curl - 4.0f * across * across;
        return Vec3{across, height * (v - 0.16f * curl * curl), out};
    });
}

Shape corinthian_capital() {
    Shape capital = lathe({{0.200f, 0},
                           {0.225f, 0.01f},
                           {0.225f, 0.04f},
                           {0.200f, 0.05f},
                           {0.205f, 0.20f},
                           {0.235f, 0.32f},
                           {0.300f, 0.38f},
                           {0.300f, 0.41f},
                           {0, 0.41f}},
                          28);
    for (int i = 0; i < 16; ++i) {
        const bool front = i % 2 == 0;
        append(capital, capital_leaf(front ? 0.205f : 0.212f, front ? 0.20f : 0.33f),
               {.origin = {0, 0.05f, 0}, .turn = k_pi * float(i) / 8});
    }
    return capital;
}

/// Attic base, shaft that swells a little (entasis), capital, abacus. Height 3.3 m.
Shape lower_column() {
    std::vector<ProfilePoint> profile{{0.31f, 0.14f}};
    const auto torus = [&](float radius, float low, float bulge) {
        for (int i = 0; i <= 4; ++i) {
            const float a = k_pi * (float(i) / 4 - 0.5f);
            profile.push_back({radius + bulge * std::cos(a), low + bulge * (1 + std::sin(a))});
        }
    };
    torus(0.27f, 0.14f, 0.045f);
    profile.push_back({0.25f, 0.24f});
    profile.push_back({0.245f, 0.27f});
    torus(0.25f, 0.28f, 0.025f);
    profile.push_back({0.235f, 0.34f});
    for (int i = 0; i <= 6; ++i) {
        const float t = float(i) / 6;
        profile.push_back({0.232f - 0.034f * std::pow(t, 1.8f), lerp(0.36f, 2.79f, t)});
    }
    Shape column = lathe(profile, 28);
    append(column, box({-0.32f, 0, -0.32f}, {0.32f, 0.14f, 0.32f}, 0.012f));
    append(column, corinthian_capital(), {.origin = {0, 2.79f, 0}});
    append(column, box({-0.33f, 3.2f, -0.33f}, {0.33f, 3.3f, 0.33f}, 0.02f));
    return column;
}

/// A Tuscan column on a pedestal as high as the balustrade. Height 2.9 m.
Shape upper_column() {
    Shape column = lathe({{0.20f, 1.06f},
                          {0.215f, 1.08f},
                          {0.215f, 1.12f},
                          {0.18f, 1.16f},
                          {0.165f, 1.19f},
                          {0.165f, 1.6f},
                          {0.158f, 2.1f},
                          {0.145f, 2.58f},
                          {0.165f, 2.60f},
                          {0.165f, 2.63f},
                          {0.145f, 2.65f},
                          {0.145f, 2.70f},
                          {0.215f, 2.80f}},
                         28);
    append(column, box({-0.24f, 0, -0.24f}, {0.24f, 0.96f, 0.24f}, 0.015f));
    append(column, box({-0.28f, 0.96f, -0.28f}, {0.28f, 1.06f, 0.28f}, 0.025f));
    append(column, box({-0.24f, 2.8f, -0.24f}, {0.24f, 2.9f, 0.24f}, 0.015f));
    return column;
}

/// The square piers at the corners of the court, through both floors.
void add_piers(Model& model) {
    for (const float x : {-k_half_x, k_half_x})
        for (const float z : {-k_half_z, k_half_z}) {
            const Placement at{.origin = {x, 0, z}};
            block(model, Stuff::limestone, at, {0, k_lower_floor, 0}, {0.8f, 0.4f, 0.8f}, 0.03f);
            block(model, Stuff::limestone, at, {0, k_lower_floor, 0}, {0.7f, k_cornice - k_lower_floor, 0.7f},
                  0.02f);
            for (const float y : {k_lower_spring - 0.14f, k_upper_spring - 0.1f})
                block(model, Stuff::marble, at, {0, y, 0}, {0.84f, 0.14f, 0.84f}, 0.03f);
        }
}

// --- Bays

Shape baluster() {
    return lathe({{0.045f, 0},
                  {0.045f, 0.04f},
                  {0.030f, 0.06f},
                  {0.060f, 0.20f},
                  {0.066f, 0.27f},
                  {0.028f, 0.50f},
                  {0.026f, 0.56f},
                  {0.045f, 0.61f},
                  {0.045f, 0.66f}},
                 10);
}

void add_balustrade(Model& model, const Placement& bay) {
    const float y = k_upper_floor;
    block(model, Stuff::marble, bay, {0, y, 0}, {k_bay - 0.48f, 0.14f, 0.22f});
    block(model, Stuff::marble, bay, {0, y + 0.8f, 0}, {k_bay - 0.48f, 0.16f, 0.26f}, 0.03f);
    constexpr int k_balusters = 8;
    const Shape one = baluster();
    for (int i = 0; i < k_balusters; ++i) {
        const float x = (float(i) - 0.5f * (k_balusters - 1)) * 0.28f;
        model.add(Stuff::marble, one, moved(bay, {x, y + 0.14f, 0}));
    }
}

void add_arch(Model& model, const Placement& bay, float spring, float height) {
    const Placement at = moved(bay, {0, spring, 0});
    model.add(Stuff::limestone, arch_wall({k_bay, height, k_arch_radius, k_arcade_depth}, 20), at);
    // From the opening outwards; the inner edge stands a little into it, so that no two faces coincide.
    constexpr float k_face = k_arcade_depth / 2;
    const std::vector<Vec2> court_side{
        {-0.01f, k_face},        {-0.01f, k_face + 0.05f}, {0.09f, k_face + 0.05f}, {0.10f, k_face + 0.03f},
        {0.19f, k_face + 0.03f}, {0.20f, k_face + 0.07f},  {0.25f, k_face + 0.07f}, {0.25f, k_face}};
    const std::vector<Vec2> gallery_side{
        {-0.01f, k_face}, {-0.01f, k_face + 0.04f}, {0.22f, k_face + 0.04f}, {0.22f, k_face}};
    model.add(Stuff::marble, arch_moulding(k_arch_radius, court_side, 20), at);
    model.add(Stuff::marble, arch_moulding(k_arch_radius, gallery_side, 20), moved(at, {}, k_pi));
    // The keystone.
    block(model, Stuff::marble, at, {0, k_arch_radius - 0.04f, 0}, {0.24f, 0.42f, k_arcade_depth + 0.22f},
          0.03f);
}

void add_vault(Model& model, const Placement& bay) {
    const float front = k_arcade_depth / 2, depth = k_gallery - front;
    model.add(Stuff::plaster, groin_vault(k_bay, depth, 1.5f, 12),
              moved(bay, {0, k_lower_spring, -front - depth / 2}));
    // A pilaster carries it at the wall, on the bay's edge.
    block(model, Stuff::limestone, bay, {-k_bay / 2, k_lower_floor, -k_gallery + 0.07f},
          {0.42f, 3.16f, 0.16f});
    block(model, Stuff::marble, bay, {-k_bay / 2, k_lower_spring - 0.14f, -k_gallery + 0.1f},
          {0.54f, 0.14f, 0.26f}, 0.03f);
}

/// An oak door under a half round light, in a frame of stone; on the outer wall's inner face.
void add_door(Model& model, const Placement& bay, float floor, float scale) {
    const float wall = -k_gallery, half = 0.62f * scale, jamb = 2.1f * scale;
    const Placement at = moved(bay, {0, floor, wall});
    for (const float side : {-1.0f, 1.0f}) {
        block(model, Stuff::limestone, at, {side * (half + 0.12f), 0, 0.07f}, {0.24f, jamb, 0.18f});
        block(model, Stuff::oak, at, {side * half / 2, 0, 0.03f}, {half - 0.01f, jamb, 0.06f});
        model.add(Stuff::brass, ball(0.035f, 8), moved(at, {side * 0.07f, 0.48f * jamb, 0.09f}));
    }
    block(model, Stuff::limestone, at, {0, jamb - 0.06f, 0.08f}, {2 * half + 0.52f, 0.12f, 0.2f}, 0.02f);
    const std::vector<Vec2> band{{0, 0.03f},     {0, 0.16f},     {0.20f, 0.16f},
                                 {0.22f, 0.18f}, {0.26f, 0.18f}, {0.26f, 0.0f}};
    model.add(Stuff::limestone, arch_moulding(half - 0.01f, band, 20), moved(at, {0, jamb, 0}));
    Shape fan;
    std::vector<Vec3> rim;
    for (int i = 0; i <= 20; ++i) {
        const float a = k_pi * float(i) / 20;
        rim.push_back({half * std::cos(a), half * std::sin(a), 0.04f});
    }
    add_polygon(fan, rim, {0, 0, 1});
    model.add(Stuff::oak, fan, moved(at, {0, jamb, 0}));
}

void add_ceiling_beams(Model& model, const Placement& bay) {
    for (const float x : {-0.5f * k_bay, 0.0f})
        block(model, Stuff::oak, bay, {x, k_cornice - 0.2f, -k_gallery / 2}, {0.16f, 0.22f, k_gallery});
}

void add_bays(Model& model) {
    const Shape lower = lower_column(), upper = upper_column();
    for (const Bay& bay : all_bays()) {
        add_arch(model, bay.place, k_lower_spring, k_upper_floor - 0.4f - k_lower_spring);
        add_arch(model, bay.place, k_upper_spring, k_cornice - k_upper_spring);
        add_vault(model, bay.place);
        add_balustrade(model, bay.place);
        add_ceiling_beams(model, bay.place);
        if (bay.index > 0) {  // a side's first bay starts at a corner pier
            model.add(Stuff::marble, lower, moved(bay.place, {-k_bay / 2, k_lower_floor, 0}));
            model.add(Stuff::marble, upper, moved(bay.place, {-k_bay / 2, k_upper_floor, 0}));
        }
        if (bay.index % 2 == 1) add_door(model, bay.place, k_lower_floor, 1);
        if (bay.index % 2 == 0) add_door(model, bay.place, k_upper_floor, 0.85f);
    }
    for (const float x : {-1.0f, 1.0f})
        for (const float z : {-1.0f, 1.0f})
            model.add(
                Stuff::plaster, groin_vault(k_gallery, k_gallery, 1.5f, 12),
                {.origin = {x * (k_half_x + k_gallery / 2), k_lower_spring, z * (k_half_z + k_gallery / 2)}});
}

// --- Floors, walls, roof

/// A frame of boxes round the court, from `inner` to `outer` metres beyond its edge.
void add_ring(Model& model, Stuff stuff, float inner, float outer, float low, float high, float bevel) {
    for (const float side : {-1.0f, 1.0f}) {
        const auto both = [](float a, float b) { return std::pair{std::min(a, b), std::max(a, b)}; };
        const auto [x0, x1] = both(side * (k_half_x + inner), side * (k_half_x + outer));
        model.add(stuff, box({x0, low, -k_half_z - outer}, {x1, high, k_half_z + outer}, bevel));
        const auto [z0, z1] = both(side * (k_half_z + inner), side * (k_half_z + outer));
        model.add(stuff, box({-k_half_x - inner, low, z0}, {k_half_x + inner, high, z1}, bevel));
    }
}

void add_floors(Model& model) {
    const auto slab = [&](Stuff stuff, float x0, float x1, float z0, float z1) {
        Shape shape;
        add_polygon(shape, {{x0, 0, z0}, {x0, 0, z1}, {x1, 0, z1}, {x1, 0, z0}}, {0, 1, 0});
        model.add(stuff, shape);
    };
    constexpr float k_inlay_x = 3, k_inlay_z = 11;
    slab(Stuff::inlay, -k_inlay_x, k_inlay_x, -k_inlay_z, k_inlay_z);
    slab(Stuff::flagstone, -k_half_x, -k_inlay_x, -k_half_z, k_half_z);
    slab(Stuff::flagstone, k_inlay_x, k_half_x, -k_half_z, k_half_z);
    slab(Stuff::flagstone, -k_inlay_x, k_inlay_x, -k_half_z, -k_inlay_z);
    slab(Stuff::flagstone, -k_inlay_x, k_inlay_x, k_inlay_z, k_half_z);
    add_ring(model, Stuff::flagstone, -0.45f, k_gallery + 0.2f, -0.2f, k_lower_floor, 0.015f);
    add_ring(model, Stuff::limestone, -0.2f, k_gallery + 0.2f, k_upper_floor - 0.4f, k_upper_floor, 0.01f);
    add_ring(model, Stuff::oak, 0.2f, k_gallery + 0.2f, k_cornice, k_cornice + 0.1f, 0);
}

void add_mouldings(Model& model) {
    // Inwards and up: a shelf, an ogee in three facets, a flat edge, and the top that sheds the rain.
    const std::vector<Vec2> string_course{{0.25f, 0.0f},  {0.32f, 0.02f}, {0.34f, 0.10f},
                                          {0.42f, 0.16f}, {0.42f, 0.26f}, {0.25f, 0.40f}};
    const std::vector<Vec2> cornice{{0.25f, -0.12f}, {0.30f, -0.10f}, {0.32f, 0.02f}, {0.42f, 0.10f},
                                    {0.44f, 0.20f},  {0.56f, 0.26f},  {0.56f, 0.36f}, {0.2f, 0.42f}};
    model.add(Stuff::marble, inner_moulding(k_half_x, k_half_z, string_course),
              {.origin = {0, k_upper_floor - 0.4f, 0}});
    model.add(Stuff::marble, inner_moulding(k_half_x, k_half_z, cornice), {.origin = {0, k_cornice, 0}});
    for (const Bay& bay : all_bays())
        for (int i = 0; i < 8; ++i)
            block(model, Stuff::marble, bay.place, {(float(i) - 3.5f) * 0.35f, k_cornice + 0.08f, 0.36f},
                  {0.14f, 0.14f, 0.16f}, 0);
}

/// The outer walls; the far one has an arched opening to the garden.
void add_outer_walls(Model& model) {
    constexpr float k_thick = 0.4f, k_opening = 1.05f;
    const float top = k_cornice + 2, dado = 1.0f;
    for (int side = 0; side < 4; ++side) {
        const bool far = side == 0, long_side = side % 2 == 1;
        const float half = (long_side ? k_half_z : k_half_x) + k_gallery + k_thick;
        const Placement at = moved({.turn = 0.5f * k_pi * float(side)},
                                   {0, 0, -(long_side ? k_half_x : k_half_z) - k_gallery - k_thick / 2});
        const auto wall = [&](float x0, float x1, float y0, float y1) {
            model.add(Stuff::plaster, box({x0, y0, -k_thick / 2}, {x1, y1, k_thick / 2}), at);
            if (y0 == 0)
                model.add(Stuff::limestone,
                          box({x0, 0, 0}, {x1, k_lower_floor + dado, k_thick / 2 + 0.05f}, 0.02f), at);
        };
        if (!far) {
            wall(-half, half, 0, top);
            continue;
        }
        const float spring = k_lower_floor + 2.4f, crown = spring + 1.5f;
        wall(-half, -k_opening, 0, crown);
        wall(k_opening, half, 0, crown);
        wall(-half, half, crown, top);
        model.add(Stuff::limestone,
                  arch_wall({2 * k_opening, crown - spring, k_opening - 0.001f, k_thick}, 24),
                  moved(at, {0, spring, 0}));
        Shape gate;
        add_card(gate, {0, spring / 2, 0}, {2 * k_opening, 0, 0}, {0, spring, 0});
        for (Vertex& v : gate.vertices) v.uv = {v.uv.x * 2, v.uv.y * 2.4f};
        model.add(Stuff::iron_grille, gate, at);
    }
}

/// Tiled roofs that slope down to the court; each side's ends meet the next on the diagonal.
void add_roof(Model& model) {
    constexpr float k_eave = 0.62f, k_back = k_gallery + 0.5f, k_rise = 1.9f, k_tile = 0.3f;
    for (int side = 0; side < 4; ++side) {
        const bool long_side = side % 2 == 1;
        const float reach = long_side ? k_half_x : k_half_z, half = long_side ? k_half_z : k_half_x;
        const int tiles = int(2 * half / k_tile);
        const Placement at = moved({.turn = 0.5f * k_pi * float(side)}, {0, k_cornice + 0.44f, -reach});
        const auto roof = [=](float u, float v) {
            const float z = lerp(k_eave, -k_back, v);
            const float wave = 0.045f * std::sin(2 * k_pi * u * float(tiles));
            return Vec3{(2 * u - 1) * (half - z), k_rise * v + wave, z};
        };
        model.add(Stuff::terracotta, sheet(tiles * 4, 4, {2 * half, 5}, roof), at);
    }
    for (const Bay& bay : all_bays())
        for (int i = 0; i < 6; ++i)
            block(model, Stuff::oak, bay.place, {(float(i) - 2.5f) * k_bay / 6, k_cornice + 0.3f, 0.3f},
                  {0.09f, 0.1f, 0.62f}, 0);
}

void add_garden(Model& model) {
    Shape lawn;
    const float z0 = -k_half_z - k_gallery - 0.4f;
    add_polygon(lawn, {{-60, -0.05f, z0}, {60, -0.05f, z0}, {60, -0.05f, z0 - 80}, {-60, -0.05f, z0 - 80}},
                {0, 1, 0});
    model.add(Stuff::grass, lawn);
    // An avenue of cypresses, seen through the gate.
    for (int row = 0; row < 5; ++row)
        for (const float side : {-1.0f, 1.0f}) {
            const Placement at{.origin = {side * 2.6f, 0, z0 - 4 - 4 * float(row)}};
            model.add(Stuff::bark, lathe({{0.14f, -0.05f}, {0.12f, 0.8f}}, 10), at);
            model.add(
                Stuff::grass,
                lathe({{0.2f, 0.5f}, {0.75f, 1.2f}, {0.85f, 2.2f}, {0.7f, 4.0f}, {0.35f, 6.0f}, {0, 7.2f}},
                      14),
                at);
        }
}

}  // namespace

std::vector<Bay> all_bays() {
    std::vector<Bay> bays;
    for (int side = 0; side < 4; ++side) {
        const bool long_side = side % 2 == 1;
        const int count = long_side ? k_bays_z : k_bays_x;
        for (int i = 0; i < count; ++i) {
            const float along = (float(i) - 0.5f * float(count - 1)) * k_bay;
            bays.push_back(
                {side, i,
                 moved({.turn = 0.5f * k_pi * float(side)}, {along, 0, -(long_side ? k_half_x : k_half_z)})});
        }
    }
    return bays;
}

Placement moved(const Placement& place, Vec3 by, float further_turn) {
    return {place.origin + turned(by, place.turn), place.turn + further_turn, place.scale};
}

void build_house(Model& model) {
    add_floors(model);
    add_piers(model);
    add_bays(model);
    add_mouldings(model);
    add_outer_walls(model);
    add_roof(model);
    add_garden(model);
}

}  // namespace pathscope::atrium
