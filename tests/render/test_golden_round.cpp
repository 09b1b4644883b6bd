#include "pathscope/render/golden_round.hpp"

#include <cmath>
#include <set>

#include "pathscope/core/clock.hpp"

#include "testing.hpp"

using namespace pathscope;

namespace {

std::uint64_t lit_pixels(const std::vector<PixelSum>& sums) {
    std::uint64_t lit = 0;
    for (const PixelSum& sum : sums) lit += sum != PixelSum{};
    return lit;
}

}  // namespace

TEST_CASE("the golden round is the same every time, whatever finds the hits") {
    const GoldenScene golden = make_golden_scene();
    CHECK(render_golden(golden) == golden_hash());
    CHECK(render_golden(make_golden_scene()) == golden_hash());
    MESSAGE("golden hash: ", to_hex(golden_hash()));  // tests/system/test_same_bits.py compares it.
}

TEST_CASE("the golden round holds some of everything") {
    const GoldenScene golden = make_golden_scene();
    const CameraFrame camera = make_camera(golden.camera, golden.round.rect.width, golden.round.rect.height);
    std::set<std::pair<MaterialKind, bool>> seen;  // With the question whether it lets something through.
    bool sees_textures = false, sees_sphere = false, sees_light = false;
    int to_the_sky = 0;
    for (int y = 0; y < golden.round.rect.height; ++y)
        for (int x = 0; x < golden.round.rect.width; ++x) {
            const auto hit = intersect(golden.scene, camera_ray(camera, x, y, {0.5f, 0.5f}));
            to_the_sky += !hit;
            if (!hit) continue;
            sees_sphere |= hit->point.triangle == k_no_triangle;
            sees_light |= hit->light != k_no_light;
            if (hit->point.triangle == k_no_triangle) continue;
            const Material& material =
                golden.scene.materials[golden.scene.mesh.material_of(hit->point.triangle)];
            seen.emplace(material.kind, bool(material.map_d) || material.opacity < 1);
            sees_textures |= bool(material.map_kd);
        }
    CHECK(seen.size() == k_material_kind_names.size() + 2);
    CHECK(sees_textures);
    CHECK(sees_sphere);
    CHECK(sees_light);
    CHECK(to_the_sky > 10);

    std::uint64_t paths = 0;
    for (const RenderSettings& settings : golden.settings) {
        const auto parts = render_both_parts(golden.scene, golden.camera, settings, golden.round, 1);
        const std::uint64_t pixels = std::uint64_t(golden.round.rect.area());
        CHECK(lit_pixels(parts->direct.sums) > pixels / 2);
        CHECK(lit_pixels(parts->indirect.sums) > pixels / 4);
        CHECK(parts->indirect.rays > 3 * parts->indirect.samples);
        CHECK(parts->direct.dropped_count + parts->indirect.dropped_count == 0);
        CHECK(parts->direct.saturated_count + parts->indirect.saturated_count == 0);
        paths += parts->indirect.samples;
    }
    CHECK(paths >= 3000);
}

TEST_CASE("the last bit of one corner, colour or light is enough for another golden hash") {
    const auto nudge = [](float& value) { value = std::nextafter(value, 2 * value + 1); };
    GoldenScene golden = make_golden_scene();
    nudge(golden.scene.materials[2].ks.x);
    CHECK(render_golden(golden) != golden_hash());
    golden = make_golden_scene();
    nudge(golden.camera.position.x);
    CHECK(render_golden(golden) != golden_hash());
    golden = make_golden_scene();
    nudge(golden.scene.materials[4].ior);
    CHECK(render_golden(golden) != golden_hash());
    golden = make_golden_scene();
    nudge(golden.settings[0].transport.roulette.constant_survival);
    CHECK(render_golden(golden) != golden_hash());
}

TEST_CASE("the golden round is rendered in a moment") {
    const TimeNs begun = monotonic_now();
    (void)render_golden(make_golden_scene());
    const double seconds = to_seconds(monotonic_now() - begun);
    MESSAGE("golden round: ", 1000 * seconds, " ms");
    if (!pathscope::testing::k_sanitized) CHECK(seconds < 1);  // The machine may be busy.
}
