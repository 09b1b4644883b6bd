#include "pathscope/render/golden_round.hpp"

#include <span>
#include <utility>

#include "pathscope/math/random.hpp"
#include "pathscope/render/tile_filter.hpp"

namespace pathscope {
namespace {

constexpr int k_width = 24, k_height = 16;
constexpr std::uint32_t k_samples = 2;
constexpr int k_terrain = 10;  ///< Vertices along a side.

/// A sample brighter than 2^7 saturates; a float near 1 keeps all of its bits.
constexpr Quantum k_fine_quantum{-36};

Image8 speckles(int channels, HashRng& rng) {
    Image8 image;
    image.width = image.height = 8;
    image.channels = channels;
    for (int i = 0; i < image.width * image.height * channels; ++i)
        image.bytes.push_back(std::uint8_t(rng.next_u32()));
    return image;
}

/// One or two of each kind; every texture is used.
std::vector<Material> materials() {
    std::vector<Material> all(9);
    for (Material& material : all) material.kd = {0.7f, 0.5f, 0.3f};
    const auto use = [](std::int32_t index) { return TextureUse{index, {3, 2}, {0.25f, 0.125f}}; };
    all[0].kind = MaterialKind::lambert;
    all[0].map_kd = use(0);
    all[1].ks = {0.04f, 0.04f, 0.04f};  // Plastic.
    all[1].roughness = 0.4f;
    all[1].map_kd = use(0);
    all[2].kd = {0, 0, 0};  // Metal.
    all[2].ks = {0.9f, 0.7f, 0.4f};
    all[2].map_roughness = use(1);
    all[3].kind = MaterialKind::mirror;
    all[3].ks = {0.95f, 0.9f, 0.85f};
    all[4].kind = MaterialKind::dielectric;
    all[5].kind = MaterialKind::thin_glass;
    all[6].map_d = use(1);
    all[6].map_ks = use(0);
    all[6].ks = {0.2f, 0.2f, 0.2f};
    all[7].opacity = 0.6f;
    all[7].kind = MaterialKind::lambert;
    all[8].kd = {0, 0, 0};
    all[8].ke = {6, 5, 3};
    return all;
}

/// A crumpled sheet in a shed: triangles of all materials, some of their corners with normals.
Mesh terrain(HashRng& rng) {
    Mesh mesh;
    const auto centred = [&] { return rng.next_float() - 0.5f; };
    for (int z = 0; z < k_terrain; ++z)
        for (int x = 0; x < k_terrain; ++x) {
            const Vec3 grid{float(x) - 0.5f * (k_terrain - 1), 0, float(z) - 0.5f * (k_terrain - 1)};
            mesh.positions.push_back(grid + 0.7f * Vec3{centred(), 2 * centred(), centred()});
            mesh.normals.push_back(x % 3 == 0 ? Vec3{0, 0, 0} : normalize(Vec3{centred(), 1, centred()}));
            mesh.uvs.push_back({0.3f * float(x), 0.2f * float(z)});
        }
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t material) {
        mesh.triangles.push_back({a, b, c});
        mesh.materials.push_back(material);
    };
    for (std::uint32_t z = 0; z + 1 < k_terrain; ++z)
        for (std::uint32_t x = 0; x + 1 < k_terrain; ++x) {
            const std::uint32_t corner = z * k_terrain + x;
            add(corner, corner + k_terrain, corner + 1, rng.next_u32() % 9);
            add(corner + 1, corner + k_terrain, corner + k_terrain + 1, rng.next_u32() % 9);
        }
    const auto add_quad = [&](Vec3 corner, Vec3 u, Vec3 v, std::uint32_t material) {
        const auto first = std::uint32_t(mesh.positions.size());
        for (const Vec2 at : {Vec2{0, 0}, Vec2{1, 0}, Vec2{1, 1}, Vec2{0, 1}}) {
            mesh.positions.push_back(corner + at.x * u + at.y * v);
            mesh.normals.push_back({0, 0, 0});
            mesh.uvs.push_back(at);
        }
        add(first, first + 1, first + 2, material);
        add(first, first + 2, first + 3, material);
    };
    add_quad({-7, -2.5f, -7}, {0, 0, 14}, {14, 0, 0}, 0);
    add_quad({-7, -2.5f, -7}, {14, 0, 0}, {0, 5, 0}, 1);
    add_quad({-7, -2.5f, -7}, {0, 9, 0}, {0, 0, 14}, 0);
    add_quad({7, -2.5f, -7}, {0, 0, 14}, {0, 9, 0}, 2);
    add_quad({-7, 6.5f, -7}, {7, 0, 0}, {0, 0, 14}, 0);  // The sky is seen beside it.
    return mesh;
}

Image sky_picture(HashRng& rng) {
    Image sky(8, 4);
    for (Rgb& pixel : sky.pixels) pixel = {rng.next_float(), rng.next_float(), rng.next_float()};
    return sky;
}

SceneFile lit_scene() {
    SceneFile file;
    file.name = "golden";
    file.lights = {EmissiveMtlSpec{},
                   QuadLightSpec{{-2, 5, -1}, {2, 0, 0}, {0, 0, 2}, {4, 4, 4}},
                   SphereLightSpec{{1.5f, 1.5f, 1}, 0.75f, {2, 3, 4}},
                   PointLightSpec{{-3, 3, 2}, {5, 5, 9}},
                   SunSpec{{0.3f, 1, 0.2f}, {0.8f, 0.7f, 0.6f}, 2},
                   EnvmapSpec{"sky", 0.5f, 30}};
    return file;
}

/// The levers, so that each position of each is in one of them.
std::array<RenderSettings, 4> all_levers() {
    std::array<RenderSettings, 4> all;
    for (RenderSettings& settings : all) {
        settings.width = k_width;
        settings.height = k_height;
        settings.spp = settings.direct_spp = k_samples;
        settings.quantum = k_fine_quantum;
    }
    all[0].transport = make_settings(Setting::textbook);
    TransportSettings& mixed = all[1].transport;
    mixed.light = LightSampling::power;
    mixed.hemisphere = HemisphereSampling::cosine;
    mixed.mis = MisHeuristic::balance;
    mixed.roulette.kind = Roulette::efficiency;
    mixed.max_bounces = 6;
    all[2].filter = all[3].filter = FilterPlace::server;
    all[2].filter_kind = FilterKind::joint;
    all[2].bilateral.radius = 3;
    all[3].filter_kind = FilterKind::atrous;
    all[3].atrous.levels = 3;
    all[3].seed = 2;
    return all;
}

void add_sums(Hasher& hasher, const std::vector<PixelSum>& sums) {
    static_assert(sizeof(PixelSum) == 24);
    hasher.add(std::as_bytes(std::span(sums)));
}

}  // namespace

GoldenScene make_golden_scene() {
    HashRng rng(1);
    SceneParts parts;
    parts.materials = materials();
    parts.textures = {Texture(TextureUsage::colour, speckles(3, rng)),
                      Texture(TextureUsage::grey, speckles(1, rng), TexelSpace::srgb)};
    parts.mesh = terrain(rng);
    parts.envmap = sky_picture(rng);
    Result<Scene> scene = make_scene(lit_scene(), std::move(parts), {.threads = 1});
    CHECK(bool(scene), scene.error().message);
    return {std::move(*scene),
            {{2.5f, 4, 6}, {0, 0, 0}, {0, 1, 0}, 60},
            all_levers(),
            {0, {0, 0, k_width, k_height}, 0, k_samples}};
}

Digest render_golden(const GoldenScene& golden) {
    Hasher hasher;
    for (const RenderSettings& settings : golden.settings) {
        const auto parts = render_both_parts(golden.scene, golden.camera, settings, golden.round, 1);
        add_sums(hasher, parts->direct.sums);
        add_sums(hasher, parts->indirect.sums);
        if (settings.filter != FilterPlace::off)
            add_sums(hasher, filter_tile(golden.scene, golden.camera, settings, golden.round,
                                         parts->indirect.sums, 1));
    }
    return hasher.finish();
}

const Digest& golden_hash() {
    static const Digest hash = render_golden(make_golden_scene());
    return hash;
}

}  // namespace pathscope
