#include "pathscope/math/random.hpp"
#include "pathscope/scene/surface.hpp"
#include "small_scenes.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

Vec3 random_direction(HashRng& rng) {
    for (;;) {
        const Vec3 v{2 * rng.next_float() - 1, 2 * rng.next_float() - 1, 2 * rng.next_float() - 1};
        if (length_squared(v) <= 1 && length_squared(v) > 1e-4f) return normalize(v);
    }
}

/// A square at z = 0 of one material, its front towards +z, lit by a sky.
Scene square_of(Material material, std::optional<Image8> texture = {},
                TextureUsage usage = TextureUsage::colour) {
    SceneParts parts = empty_parts();
    if (texture) parts.textures.emplace_back(usage, *texture);
    add_rectangle(parts, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, add_material(parts, std::move(material)));
    return small_scene(std::move(parts), {SkySpec{{1, 1, 1}}});
}

SceneHit hit_at(const Scene& scene, Vec2 where) {
    const auto hit = intersect(scene, {{where.x, where.y, 1}, {0, 0, -1}});
    REQUIRE(hit);
    return *hit;
}

ShadedPoint seen_along(const Scene& scene, Vec3 outgoing) {
    return shade_point(scene, hit_at(scene, {0.1f, 0.2f}), normalize(outgoing));
}

Material of_kind(MaterialKind kind) {
    Material material = grey();
    material.kind = kind;
    return material;
}

}  // namespace

TEST_CASE("a bent normal keeps the viewer on his side and the mirror direction above the triangle") {
    HashRng rng(2);
    int bent = 0;
    for (int i = 0; i < 100'000; ++i) {
        const Vec3 geometric = random_direction(rng), outgoing = random_direction(rng);
        Vec3 shading = random_direction(rng);
        if (dot(shading, geometric) < 0) shading = -shading;
        const Vec3 normal = bend_normal(shading, geometric, outgoing);
        const float side = dot(geometric, outgoing) >= 0 ? 1.0f : -1.0f;

        CHECK(std::abs(length(normal) - 1) < 1e-5f);
        CHECK(dot(normal, outgoing) * side > 0);
        CHECK(dot(reflect(outgoing, normal), geometric) * side > 0);
        const bool was_fine = dot(reflect(outgoing, shading), geometric) * side >= 0.01f;
        if (was_fine) CHECK(normal == shading);
        bent += normal != shading;
    }
    CHECK(bent > 10'000);
}

TEST_CASE("a flat triangle's normal is never bent, however grazing the view") {
    HashRng rng(3);
    for (int i = 0; i < 10'000; ++i) {
        const Vec3 n = random_direction(rng);
        const Frame frame = Frame::around(n);
        const float height = std::pow(10.0f, -6 * rng.next_float());
        const Vec3 outgoing = normalize(frame.tangent + n * height);
        CHECK(bend_normal(n, n, outgoing) == n);
        CHECK(bend_normal(n, n, -outgoing) == n);
    }
}

TEST_CASE("a surface is seen from both sides: its frame turns to the viewer, save that of a body of glass") {
    const Vec3 front{0.3f, 0.1f, 1}, back{0.3f, 0.1f, -1};
    for (const MaterialKind kind :
         {MaterialKind::lambert, MaterialKind::standard, MaterialKind::mirror, MaterialKind::thin_glass}) {
        const Scene scene = square_of(of_kind(kind));
        CHECK(seen_along(scene, front).frame.normal.z == doctest::Approx(1));
        CHECK(seen_along(scene, back).frame.normal.z == doctest::Approx(-1));
        CHECK(seen_along(scene, back).geometric_normal.z == doctest::Approx(-1));
    }
    const Scene glass = square_of(of_kind(MaterialKind::dielectric));
    CHECK(seen_along(glass, front).frame.normal.z == doctest::Approx(1));
    CHECK(seen_along(glass, back).frame.normal.z == doctest::Approx(1));
}

TEST_CASE("light does not leak: a direction between the two tangent planes is consistent with neither side") {
    ShadedPoint point;
    point.geometric_normal = {0, 0, 1};
    point.frame = Frame::around(normalize(Vec3{1, 0, 1}));
    CHECK(is_consistent(point, normalize(Vec3{0, 0, 1})));
    CHECK(is_consistent(point, normalize(Vec3{0, 0, -1})));
    CHECK_FALSE(
        is_consistent(point, normalize(Vec3{1, 0, -0.5f})));  // Above the shading plane, below the triangle.
    CHECK_FALSE(is_consistent(point, normalize(Vec3{-1, 0, 0.5f})));
}

TEST_CASE("every kind of material becomes its BSDF, with its parameters") {
    Material material = grey();
    material.kd = {0.1f, 0.2f, 0.3f};
    material.ks = {0.4f, 0.5f, 0.6f};
    material.roughness = 0.25f;
    material.ior = 1.7f;
    material.opacity = 0.5f;
    const auto bsdf_of = [&](MaterialKind kind) {
        material.kind = kind;
        return seen_along(square_of(material), {0, 0, 1}).bsdf;
    };
    CHECK(std::get<Lambert>(bsdf_of(MaterialKind::lambert).surface).albedo == material.kd);
    const auto standard = std::get<StandardSurface>(bsdf_of(MaterialKind::standard).surface);
    CHECK(standard.diffuse == material.kd);
    CHECK(standard.f0 == material.ks);
    CHECK(standard.roughness == 0.25f);
    CHECK(std::get<Mirror>(bsdf_of(MaterialKind::mirror).surface).tint == material.ks);
    CHECK(std::get<Dielectric>(bsdf_of(MaterialKind::dielectric).surface).eta == 1.7f);
    CHECK(std::get<ThinGlass>(bsdf_of(MaterialKind::thin_glass).surface).eta == 1.7f);
    CHECK(bsdf_of(MaterialKind::lambert).opacity == 0.5f);
}

TEST_CASE("textures multiply colours, and a roughness map takes the place of the value") {
    Material material = of_kind(MaterialKind::standard);
    material.roughness = 0.9f;
    material.map_kd.index = 0;
    const Image8 red_white{2, 1, 3, {255, 0, 0, 255, 255, 255}};
    const Scene painted = square_of(material, red_white);
    const auto diffuse_at = [&](float x) {
        return std::get<StandardSurface>(make_bsdf(painted, hit_at(painted, {x, 0})).surface).diffuse;
    };
    CHECK(length(diffuse_at(-0.5f) - Vec3{0.5f, 0, 0}) < 1e-5f);  // The centres of the two texels.
    CHECK(length(diffuse_at(0.5f) - Vec3{0.5f, 0.5f, 0.5f}) < 1e-5f);

    material.map_kd.index = -1;
    material.map_roughness.index = 0;
    const Scene brushed = square_of(material, Image8{1, 1, 1, {51}}, TextureUsage::grey);
    const Bsdf bsdf = make_bsdf(brushed, hit_at(brushed, {0, 0}));
    CHECK(std::get<StandardSurface>(bsdf.surface).roughness == doctest::Approx(0.2));
}

TEST_CASE("the albedo for guides is the colour of the surface, from either side") {
    const Scene scene = square_of(grey());
    for (const float z : {1.0f, -1.0f})
        CHECK(length(surface_albedo(scene, hit_at(scene, {0, 0}), {0, 0, z}) - Vec3{0.5f, 0.5f, 0.5f}) <
              0.02f);
}
