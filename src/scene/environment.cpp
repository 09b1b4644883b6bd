#include "pathscope/scene/environment.hpp"

#include <fmt/format.h>

#include "pathscope/sampling/unit_circle.hpp"

namespace pathscope {
namespace {

/// atan(t) in radians for t in [0, 1]: the nearest of 0, π/8, π/4 is taken off by the addition theorem, so
/// that the series runs over |x| <= tan(π/16) < 0.2 only. Error below 2e-7.
float arc_tangent(float t) {
    constexpr float k_tan_1_16 = 0.19891237f, k_tan_2_16 = 0.41421356f, k_tan_3_16 = 0.66817864f;  // of π
    float base = 0, x = t;
    if (t > k_tan_3_16) {
        base = k_pi / 4;
        x = (t - 1) / (t + 1);
    } else if (t > k_tan_1_16) {
        base = k_pi / 8;
        x = (t - k_tan_2_16) / (1 + t * k_tan_2_16);
    }
    const float x2 = x * x;
    return base + x * (1 - x2 * (1 / 3.0f - x2 * (1 / 5.0f - x2 * (1 / 7.0f - x2 / 9.0f))));
}

/// The angle of (x, y) from the x axis in radians, in [-π, π].
float polar_angle(float y, float x) {
    const float ax = std::abs(x), ay = std::abs(y);
    if (ax == 0 && ay == 0) return 0;
    float angle = ax >= ay ? arc_tangent(ay / ax) : k_pi / 2 - arc_tangent(ax / ay);
    if (x < 0) angle = k_pi - angle;
    return y < 0 ? -angle : angle;
}

/// Bilinear radiance at (u, v): around in u, held at the first and last row.
Rgb bilinear(const Image& image, Vec2 uv) {
    const float x = uv.x * float(image.width) - 0.5f, y = uv.y * float(image.height) - 0.5f;
    const float left = std::floor(x), top = std::floor(y);
    const int x0 = (int(left) + image.width) % image.width, x1 = (int(left) + 1) % image.width;
    const int y0 = std::max(0, int(top)), y1 = std::min(image.height - 1, int(top) + 1);
    const auto row0 = image.row(y0), row1 = image.row(y1);
    return lerp(lerp(row0[x0], row0[x1], x - left), lerp(row1[x0], row1[x1], x - left), y - top);
}

/// The mean of the bilinear picture over one texel: by axis, 1/8 of each neighbour and 3/4 of the texel.
Rgb mean_over_texel(const Image& image, int x, int y) {
    constexpr float k_weights[3] = {0.125f, 0.75f, 0.125f};
    Rgb sum;
    for (int dy = -1; dy <= 1; ++dy) {
        const auto row = image.row(std::clamp(y + dy, 0, image.height - 1));
        for (int dx = -1; dx <= 1; ++dx)
            sum += row[(x + dx + image.width) % image.width] * (k_weights[dx + 1] * k_weights[dy + 1]);
    }
    return sum;
}

/// The integral of sin θ over the height of a row, by θ = π v.
float sine_of_row(int y, int height) {
    const float top = unit_circle(0.5f * float(y) / float(height)).x;
    const float bottom = unit_circle(0.5f * float(y + 1) / float(height)).x;
    return (top - bottom) * 0.5f;
}

Frame picture_axes(UpAxis up, float rotate_deg) {
    const float turns = rotate_deg / 360;
    const Vec2 turn = unit_circle(turns - std::floor(turns));
    const Vec3 y = up_direction(up);
    const Vec3 x0{1, 0, 0}, z0 = cross(x0, y);
    return {x0 * turn.x - z0 * turn.y, y, z0 * turn.x + x0 * turn.y};
}

Result<void> scale_radiance(const std::string& name, Image& picture, float scale) {
    for (int y = 0; y < picture.height; ++y) {
        for (int x = 0; x < picture.width; ++x) {
            Rgb& texel = picture.at(x, y);
            texel = texel * scale;
            if (!is_finite(texel) || min_component(texel) < 0)
                return bad_input(fmt::format(
                    "{}: the radiance of pixel ({}, {}) is negative or not finite; repair the picture.", name,
                    x, y));
        }
    }
    return {};
}

}  // namespace

Vec2 lat_long_of(Vec3 d) {
    const float u = 0.5f + polar_angle(d.x, -d.z) * (0.5f * k_inv_pi);
    const float v = polar_angle(std::sqrt(d.x * d.x + d.z * d.z), d.y) * k_inv_pi;
    return {std::clamp(u - std::floor(u), 0.0f, k_one_minus_epsilon),
            std::clamp(v, 0.0f, k_one_minus_epsilon)};
}

Vec3 direction_of_lat_long(Vec2 uv) {
    const Vec2 around = unit_circle(uv.x), down = unit_circle(0.5f * uv.y);
    return {-around.y * down.y, down.x, around.x * down.y};
}

Result<EnvironmentMap> make_environment_map(const std::string& name, Image picture, float scale,
                                            float rotate_deg, UpAxis up) {
    if (!(scale > 0) || !std::isfinite(scale) || !std::isfinite(rotate_deg))
        return bad_input(fmt::format("{}: scale is {} and rotate_y {}; scale must be positive, both finite.",
                                     name, scale, rotate_deg));
    if (picture.empty()) return bad_input(fmt::format("{}: the environment map has no pixels.", name));
    if (auto scaled = scale_radiance(name, picture, scale); !scaled) return scaled.error();

    EnvironmentMap map;
    std::vector<float> weights;
    weights.reserve(picture.pixels.size());
    for (int y = 0; y < picture.height; ++y) {
        const float sine = sine_of_row(y, picture.height);
        for (int x = 0; x < picture.width; ++x) {
            const Rgb mean = mean_over_texel(picture, x, y);
            weights.push_back(luminance(mean) * sine);
            map.mean_radiance += mean * (sine / float(picture.width));
        }
    }
    auto distribution = Distribution2d::make(weights, picture.width, picture.height);
    if (!distribution)
        return bad_input(
            fmt::format("{}: the environment map is black; leave it out or take another.", name));
    map.distribution = *std::move(distribution);
    map.axes = picture_axes(up, rotate_deg);
    map.radiance = std::move(picture);
    return map;
}

Rgb environment_map_radiance(const EnvironmentMap& map, Vec3 direction) {
    return bilinear(map.radiance, lat_long_of(map.axes.to_local(direction)));
}

Vec3 sample_environment_map(const EnvironmentMap& map, Vec2 u) {
    return map.axes.to_world(direction_of_lat_long(map.distribution.sample(u).point));
}

float sample_environment_map_pdf(const EnvironmentMap& map, Vec3 direction) {
    const Vec3 local = map.axes.to_local(direction);
    const float sine = std::sqrt(local.x * local.x + local.z * local.z);
    if (!(sine > 0)) return 0;
    return map.distribution.pdf_square(lat_long_of(local)) / (2 * k_pi * k_pi * sine);
}

}  // namespace pathscope
