#include "pathscope/shading/bsdf.hpp"
#include "pathscope/shading/seen_bsdf.hpp"

#include <limits>

#include "pathscope/shading/fresnel.hpp"
#include "statistics.hpp"
#include "surfaces.hpp"

#include "testing.hpp"

using namespace pathscope;
using namespace pathscope::testing;

namespace {

constexpr HemisphereSampling k_levers[] = {HemisphereSampling::uniform, HemisphereSampling::cosine,
                                           HemisphereSampling::bsdf};

float largest_difference(Rgb a, Rgb b) { return max_component(abs(a - b)); }

/// The material as the paper prints it, in double: f_specular + base / pi * renormalised Disney diffuse.
double paper_frostbite(double base, double f0, double roughness, Vec3 o, Vec3 i) {
    const double hx = double(o.x) + i.x, hy = double(o.y) + i.y, hz = double(o.z) + i.z;
    const double length_h = std::sqrt(hx * hx + hy * hy + hz * hz);
    const double nv = o.z, nl = i.z, nh = hz / length_h;
    const double lh = (i.x * hx + i.y * hy + i.z * hz) / length_h;
    const auto schlick = [](double low, double high, double u) {
        return low + (high - low) * std::pow(1 - u, 5);
    };

    const double alpha = roughness * roughness, a2 = alpha * alpha;
    const double f90 = std::clamp(50 * 0.33 * 3 * f0, 0.0, 1.0);
    const double d = a2 / (std::numbers::pi * std::pow((nh * a2 - nh) * nh + 1, 2));
    const double v =
        0.5 / (nl * std::sqrt((-nv * a2 + nv) * nv + a2) + nv * std::sqrt((-nl * a2 + nl) * nl + a2));

    const double energy_bias = 0.5 * roughness, energy_factor = 1 + roughness * (1 / 1.51 - 1);
    const double fd90 = energy_bias + 2 * lh * lh * roughness;
    const double diffuse = schlick(1, fd90, nl) * schlick(1, fd90, nv) * energy_factor;
    return d * v * schlick(f0, f90, lh) + base * diffuse / std::numbers::pi;
}

}  // namespace

TEST_CASE("names go both ways, and name the kinds in the order of Surface") {
    for (const auto& entry : k_bsdf_names) CHECK(from_name<BsdfKind>(name_of(entry.value)) == entry.value);
    for (const auto& entry : k_hemisphere_names)
        CHECK(from_name<HemisphereSampling>(name_of(entry.value)) == entry.value);
    CHECK(bsdf_kind({Lambert{}}) == BsdfKind::lambert);
    CHECK(bsdf_kind({StandardSurface{}}) == BsdfKind::standard);
    CHECK(bsdf_kind({Mirror{}}) == BsdfKind::mirror);
    CHECK(bsdf_kind({Dielectric{}}) == BsdfKind::dielectric);
    CHECK(bsdf_kind({ThinGlass{}}) == BsdfKind::thin_glass);
    CHECK(k_bsdf_names.size() == std::variant_size_v<Surface>);
}

TEST_CASE("which surfaces are specular, and which have an inside") {
    for (const Bsdf& bsdf : smooth_surfaces()) CHECK_FALSE(is_specular(bsdf));
    for (const Bsdf& bsdf : delta_surfaces()) CHECK(is_specular(bsdf));
    CHECK(is_specular({Lambert{{1, 1, 1}}, 0}));
    CHECK(has_inside({Dielectric{}}));
    CHECK_FALSE(has_inside({ThinGlass{}}));
}

TEST_CASE("values by hand: Lambert is albedo / pi, scaled by the opacity") {
    const Bsdf bsdf{Lambert{{0.8f, 0.5f, 0.1f}}, 0.25f};
    const Vec3 up{0, 0, 1}, slanted = direction_at(0.5f);
    CHECK(eval_bsdf(bsdf, up, slanted).x == doctest::Approx(0.25 * 0.8 / std::numbers::pi));
    CHECK(sample_bsdf_pdf(bsdf, up, slanted) == doctest::Approx(0.25 * 0.5 / std::numbers::pi));
}

TEST_CASE("the standard material is the paper's wherever coat and base together conserve energy") {
    HashRng rng(1);
    for (int i = 0; i < 20'000; ++i) {
        const float base = 0.85f * rng.next_float(), f0 = 0.05f * rng.next_float();
        // Smoother surfaces keep to the paper away from grazing angles only.
        const float roughness = 0.05f + 0.95f * rng.next_float();
        const float flattest = roughness < 0.3f ? 0.2f : 0.001f;
        const Vec3 o = direction_at(lerp(flattest, 1.0f, rng.next_float()), rng.next_float());
        const Vec3 in = direction_at(lerp(flattest, 1.0f, rng.next_float()), rng.next_float());
        const float ours = eval_bsdf(standard({base, base, base}, {f0, f0, f0}, roughness), o, in).x;
        CAPTURE(base);
        CAPTURE(f0);
        CAPTURE(roughness);
        CAPTURE(o.z);
        CAPTURE(in.z);
        REQUIRE(ours == doctest::Approx(paper_frostbite(base, f0, roughness, o, in)).epsilon(1e-3));
    }
}

TEST_CASE("reciprocity: f(wo, wi) = f(wi, wo)") {
    HashRng rng(2);
    for (int i = 0; i < 20'000; ++i) {
        const Rgb diffuse{rng.next_float(), rng.next_float(), rng.next_float()};
        const Rgb f0{rng.next_float(), rng.next_float(), rng.next_float()};
        const Bsdf bsdf = standard(diffuse, f0 * f0, rng.next_float());
        const Vec3 o = direction_at(std::max(0.001f, rng.next_float()), rng.next_float());
        const Vec3 in = direction_at(std::max(0.001f, rng.next_float()), rng.next_float());
        const Rgb forth = eval_bsdf(bsdf, o, in), back = eval_bsdf(bsdf, in, o);
        REQUIRE(largest_difference(forth, back) <= 1e-4f * max_component(forth));
    }
}

TEST_CASE("one view of a surface answers many questions as if each were the first") {
    HashRng rng(5);
    for (const Bsdf& bsdf : smooth_surfaces())
        for (const HemisphereSampling lever : k_levers) {
            const Vec3 o = direction_at(0.6f, rng.next_float());
            const SeenBsdf seen = see_bsdf(bsdf, o);
            for (int i = 0; i < 100; ++i) {
                const float u_lobe = rng.next_float();
                const Vec2 u = next_2d(rng);
                const auto sample = sample_direction(lever, seen, u_lobe, u);
                const auto expected = sample_direction(lever, bsdf, o, u_lobe, u);
                REQUIRE(sample.has_value() == expected.has_value());
                if (!sample) continue;
                REQUIRE(sample->incoming == expected->incoming);
                REQUIRE(sample->weight == expected->weight);
                const BsdfValue value = eval_bsdf_and_pdf(lever, seen, sample->incoming);
                REQUIRE(value.value == expected->value);
                REQUIRE(value.pdf_solid_angle == expected->pdf_solid_angle);
            }
        }
}

TEST_CASE("nothing is reflected below the surface, and nothing seen from there") {
    const Vec3 up = direction_at(0.5f), down = direction_at(-0.3f);
    for (const Bsdf& bsdf : smooth_surfaces()) {
        for (const auto& [o, in] : {std::pair{up, down}, std::pair{down, up}, std::pair{down, down}}) {
            CHECK(is_zero(eval_bsdf(bsdf, o, in)));
            for (const HemisphereSampling lever : k_levers)
                CHECK(sample_direction_pdf(lever, bsdf, o, in) == 0);
        }
        for (const HemisphereSampling lever : k_levers)
            CHECK_FALSE(sample_direction(lever, bsdf, down, 0.3f, {0.5f, 0.5f}).has_value());
    }
}

TEST_CASE("a sample's weight is f cos / pdf, and its parts are those of eval and pdf, bit for bit") {
    HashRng rng(3);
    std::vector<Bsdf> surfaces = smooth_surfaces();
    for (Bsdf bsdf : smooth_surfaces()) {
        bsdf.opacity = 0.4f;
        surfaces.push_back(bsdf);
    }
    for (const Bsdf& bsdf : surfaces)
        for (const HemisphereSampling lever : k_levers)
            for (int i = 0; i < 2000; ++i) {
                const Vec3 o = direction_at(std::max(0.001f, rng.next_float()), rng.next_float());
                const auto sample = sample_direction(lever, bsdf, o, rng.next_float(), next_2d(rng));
                if (!sample || sample->specular) continue;
                REQUIRE(sample->value == eval_bsdf(bsdf, o, sample->incoming));
                REQUIRE(sample->pdf_solid_angle == sample_direction_pdf(lever, bsdf, o, sample->incoming));
                const BsdfValue both = eval_bsdf_and_pdf(lever, bsdf, o, sample->incoming);
                REQUIRE(both.value == sample->value);
                REQUIRE(both.pdf_solid_angle == sample->pdf_solid_angle);
                const Rgb weight = sample->value * (sample->incoming.z / sample->pdf_solid_angle);
                REQUIRE(largest_difference(weight, sample->weight) <= 1e-5f * max_component(weight));
                REQUIRE(std::abs(length(sample->incoming) - 1) < 1e-5f);
                REQUIRE(is_finite(sample->weight));
            }
}

TEST_CASE(
    "weights under BSDF sampling stay below Disney's own peak, 2.5^2 / 1.51: no fireflies of its making") {
    HashRng rng(4);
    float largest = 0;
    for (int i = 0; i < 200'000; ++i) {
        const float diffuse = rng.next_float(), f0 = rng.next_float();
        const Bsdf bsdf =
            standard({diffuse, diffuse, diffuse}, {f0 * f0, f0 * f0, f0 * f0}, rng.next_float());
        const Vec3 o = direction_at(std::max(0.001f, rng.next_float()), rng.next_float());
        if (const auto sample = sample_bsdf(bsdf, o, rng.next_float(), next_2d(rng)))
            largest = std::max(largest, max_component(sample->weight));
    }
    CAPTURE(largest);
    CHECK(largest < 4.14f);
}

TEST_CASE(
    "lobes are picked by what they reflect: weights of plastic vary by a quarter, where even odds give "
    "half") {
    for (const float roughness : {0.2f, 0.4f, 0.7f, 1.0f}) {
        const Bsdf bsdf = standard({0.5f, 0.5f, 0.5f}, {0.04f, 0.04f, 0.04f}, roughness);
        HashRng rng(1);
        Moments weight;
        for (int i = 0; i < 50'000; ++i) {
            const Vec3 o = direction_at(std::max(0.01f, rng.next_float()), rng.next_float());
            const float u_lobe = rng.next_float();
            const auto sample = sample_bsdf(bsdf, o, u_lobe, next_2d(rng));
            weight.add(sample ? sample->weight.x : 0);
        }
        CAPTURE(roughness);
        CHECK(std::sqrt(weight.variance()) / weight.mean() < 0.27);
    }
}

TEST_CASE("delta lobes: no value, no density, the same sample under each lever") {
    HashRng rng(5);
    for (const Bsdf& bsdf : delta_surfaces())
        for (int i = 0; i < 1000; ++i) {
            const float side = i % 2 == 0 ? 1.0f : -1.0f;
            const Vec3 o = direction_at(side * std::max(0.001f, rng.next_float()), rng.next_float());
            const float u_lobe = rng.next_float();
            const Vec2 u = next_2d(rng);
            const auto sample = sample_bsdf(bsdf, o, u_lobe, u);
            REQUIRE(sample.has_value());
            REQUIRE(sample->specular);
            REQUIRE(is_zero(sample->value));
            REQUIRE(sample->pdf_solid_angle == 0);
            REQUIRE(std::abs(length(sample->incoming) - 1) < 1e-6f);
            REQUIRE(is_zero(eval_bsdf(bsdf, o, sample->incoming)));
            for (const HemisphereSampling lever : k_levers) {
                REQUIRE(sample_direction_pdf(lever, bsdf, o, sample->incoming) == 0);
                REQUIRE(sample_direction(lever, bsdf, o, u_lobe, u)->incoming == sample->incoming);
            }
        }
}

TEST_CASE("a mirror reflects its tint about the normal") {
    const Vec3 o = direction_at(0.6f);
    const auto sample = sample_bsdf({Mirror{{0.9f, 0.8f, 0.7f}}}, o, 0.5f, {0.5f, 0.5f});
    CHECK(sample->incoming == reflect(o, {0, 0, 1}));
    CHECK(sample->weight == Rgb{0.9f, 0.8f, 0.7f});
    CHECK_FALSE(sample->straight);
}

TEST_CASE("a dielectric reflects as often as Fresnel says and transmits the rest: R + T = 1 in flux") {
    HashRng rng(6);
    for (const float side : {1.0f, -1.0f})
        for (const float cosine : {0.05f, 0.3f, 0.8f, 1.0f}) {
            const Bsdf bsdf{Dielectric{1.5f, {1, 1, 1}}};
            const Vec3 o = direction_at(side * cosine);
            const float eta = side > 0 ? 1.5f : 1 / 1.5f;
            const float reflectance = fresnel_dielectric(cosine, eta);
            const int n = 20'000;
            Moments reflected, flux;
            for (int i = 0; i < n; ++i) {
                const auto sample = sample_bsdf(bsdf, o, rng.next_float(), {});
                const bool same_side = (sample->incoming.z > 0) == (o.z > 0);
                reflected.add(same_side);
                // Radiance on the far side counts eta^2 more per flux: undo it.
                flux.add(sample->weight.x / sample->compression);
                if (same_side) CHECK(sample->compression == 1);
            }
            CHECK(flux.mean() == doctest::Approx(1).epsilon(1e-6));
            const double error = std::sqrt(reflectance * (1 - reflectance) / n) + 1e-9;
            CHECK(std::abs(reflected.mean() - reflectance) <= 4 * error);
        }
}

TEST_CASE("a dielectric bends by Snell's law in the plane of incidence, and back again on leaving") {
    HashRng rng(7);
    for (int i = 0; i < 1000; ++i) {
        const float eta = 1 + 1.5f * rng.next_float();
        const Bsdf bsdf{Dielectric{eta, {0.9f, 1, 1}}};
        const Vec3 o = direction_at(std::max(0.01f, rng.next_float()), rng.next_float());
        const auto enter = sample_bsdf(bsdf, o, k_one_minus_epsilon, {});
        REQUIRE(enter.has_value());
        if (enter->incoming.z > 0) continue;  // the flattest views reflect with probability 1 to rounding
        REQUIRE(enter->incoming.x * eta == doctest::Approx(-o.x).epsilon(1e-4));
        REQUIRE(enter->incoming.y * eta == doctest::Approx(-o.y).epsilon(1e-4));
        REQUIRE(enter->weight.y == doctest::Approx(1 / (eta * eta)).epsilon(1e-5));

        // From inside, back along the same ray: out comes the first direction, and the radiance is whole.
        const auto back = sample_bsdf(bsdf, enter->incoming, k_one_minus_epsilon, {});
        REQUIRE(back.has_value());
        if (back->incoming.z < 0) continue;
        REQUIRE(length(back->incoming - o) < 2e-3f);
        REQUIRE(enter->weight.y * back->weight.y == doctest::Approx(1).epsilon(1e-4));
        REQUIRE(enter->compression * back->compression == doctest::Approx(1).epsilon(1e-5));
        REQUIRE(enter->weight.x * back->weight.x == doctest::Approx(0.81).epsilon(1e-4));
    }
}

TEST_CASE("a dielectric with eta = 1 is not there") {
    const Vec3 o = direction_at(0.4f);
    const auto sample = sample_bsdf({Dielectric{1, {1, 1, 1}}}, o, 0.5f, {});
    CHECK(length(sample->incoming + o) < 1e-6f);
    CHECK(sample->weight == Rgb{1, 1, 1});
}

TEST_CASE("a pane lets through straight what it does not reflect, and says how much") {
    HashRng rng(8);
    const Bsdf bsdf{ThinGlass{1.5f, {0.9f, 1, 0.8f}}};
    for (const float cosine : {1.0f, 0.5f, -0.2f}) {
        const Vec3 o = direction_at(cosine);
        const double through = 1 - pane_reflectance(fresnel_dielectric(std::abs(cosine), 1.5f));
        CHECK(straight_transmission(bsdf, o).y == doctest::Approx(through));
        CHECK(straight_transmission(bsdf, o).x == doctest::Approx(0.9 * through));
        int straight = 0;
        const int n = 20'000;
        for (int i = 0; i < n; ++i) {
            const auto sample = sample_bsdf(bsdf, o, rng.next_float(), {});
            straight += sample->straight;
            REQUIRE(sample->incoming == (sample->straight ? -o : Vec3{-o.x, -o.y, o.z}));
            REQUIRE(sample->weight == (sample->straight ? Rgb{0.9f, 1, 0.8f} : Rgb{1, 1, 1}));
        }
        CHECK(std::abs(straight - n * through) <= 4 * std::sqrt(n * through * (1 - through)));
    }
}

TEST_CASE("opacity: the ray passes straight through with the rest of the probability, from either side") {
    HashRng rng(9);
    const float opacity = 0.3f;
    const Bsdf bsdf{Lambert{{0.8f, 0.8f, 0.8f}}, opacity};
    CHECK(straight_transmission(bsdf, {0, 0, 1}).x == doctest::Approx(0.7));
    for (const float side : {1.0f, -1.0f}) {
        const Vec3 o = direction_at(side * 0.5f);
        int straight = 0;
        const int n = 20'000;
        for (int i = 0; i < n; ++i) {
            const auto sample = sample_bsdf(bsdf, o, rng.next_float(), next_2d(rng));
            if (!sample) continue;
            straight += sample->straight;
            if (sample->straight) {
                REQUIRE(sample->incoming == -o);
                REQUIRE(sample->weight == Rgb{1, 1, 1});
                REQUIRE(sample->specular);
            }
        }
        CHECK(std::abs(straight - n * 0.7) <= 4 * std::sqrt(n * 0.7 * 0.3));
    }
    // Closed and open ends.
    CHECK_FALSE(sample_bsdf({Lambert{{1, 1, 1}}, 1}, {0, 0, 1}, k_one_minus_epsilon, {0.5f, 0.5f})->straight);
    CHECK(sample_bsdf({Lambert{{1, 1, 1}}, 0}, {0, 0, 1}, 0, {0.5f, 0.5f})->straight);
}

TEST_CASE("NaN directions and materials, as broken scenes make them, are survived") {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    std::vector<Bsdf> surfaces = smooth_surfaces();
    for (const Bsdf& bsdf : delta_surfaces()) surfaces.push_back(bsdf);
    surfaces.push_back(standard({nan, 1, 1}, {nan, 0, 0}, nan));
    surfaces.push_back(standard({1, 1, 1}, {0.5f, 0.5f, 0.5f}, -3));
    surfaces.push_back(standard({1, 1, 1}, {0.5f, 0.5f, 0.5f}, 1e9f));
    const Vec3 broken{nan, nan, nan}, up{0, 0, 1};
    for (const Bsdf& bsdf : surfaces) {
        CHECK(is_zero(eval_bsdf(bsdf, broken, up)));
        CHECK(is_zero(eval_bsdf(bsdf, up, broken)));
        (void)eval_bsdf(bsdf, up, up);
        (void)guide_albedo(bsdf, broken);
        for (const HemisphereSampling lever : k_levers) {
            (void)sample_direction(lever, bsdf, broken, 0.5f, {0.5f, 0.5f});
            (void)sample_direction(lever, bsdf, up, 0.5f, {0.5f, 0.5f});
        }
    }
}

TEST_CASE("black surfaces end the path") {
    for (const HemisphereSampling lever : k_levers) {
        CHECK_FALSE(sample_direction(lever, {Lambert{{0, 0, 0}}}, {0, 0, 1}, 0.5f, {0.5f, 0.5f}).has_value());
        CHECK_FALSE(
            sample_direction(lever, standard({0, 0, 0}, {0, 0, 0}, 0.5f), {0, 0, 1}, 0.5f, {0.5f, 0.5f})
                .has_value());
    }
}
