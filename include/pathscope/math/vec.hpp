#pragma once
/// Vectors of two and three floats, and colours.
///
/// Units: positions are in scene units, directions have length one unless said otherwise. A colour (Rgb) is
/// linear, with the primaries of sRGB; it is a Vec3 by another name, because light is added, scaled and
/// filtered in the same way. Thread safety: values.   Test: tests/math/test_math.cpp

#include <algorithm>
#include <cmath>

namespace pathscope {

struct Vec2 {
    float x = 0, y = 0;

    friend constexpr bool operator==(const Vec2&, const Vec2&) = default;
    friend constexpr Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
    friend constexpr Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
    friend constexpr Vec2 operator*(Vec2 a, float s) { return {a.x * s, a.y * s}; }
    friend constexpr Vec2 operator*(float s, Vec2 a) { return a * s; }
};

struct Vec3 {
    float x = 0, y = 0, z = 0;

    constexpr float operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
    constexpr float& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }

    friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
    friend constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
    friend constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
    friend constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend constexpr Vec3 operator*(Vec3 a, Vec3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
    friend constexpr Vec3 operator/(Vec3 a, Vec3 b) { return {a.x / b.x, a.y / b.y, a.z / b.z}; }
    friend constexpr Vec3 operator*(Vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
    friend constexpr Vec3 operator*(float s, Vec3 a) { return a * s; }
    friend constexpr Vec3 operator/(Vec3 a, float s) { return a * (1.0f / s); }
    constexpr Vec3& operator+=(Vec3 b) { return *this = *this + b; }
    constexpr Vec3& operator-=(Vec3 b) { return *this = *this - b; }
    constexpr Vec3& operator*=(Vec3 b) { return *this = *this * b; }
    constexpr Vec3& operator*=(float s) { return *this = *this * s; }
};

using Rgb = Vec3;  ///< x, y, z hold red, green, blue.

[[nodiscard]] constexpr float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
[[nodiscard]] constexpr Vec3 cross(Vec3 a, Vec3 b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
[[nodiscard]] constexpr float length_squared(Vec3 a) { return dot(a, a); }
[[nodiscard]] inline float length(Vec3 a) { return std::sqrt(length_squared(a)); }

/// Requires: a is not the zero vector.
[[nodiscard]] inline Vec3 normalize(Vec3 a) { return a / length(a); }

[[nodiscard]] constexpr Vec3 min(Vec3 a, Vec3 b) {
    return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
[[nodiscard]] constexpr Vec3 max(Vec3 a, Vec3 b) {
    return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}
[[nodiscard]] inline Vec3 abs(Vec3 a) { return {std::abs(a.x), std::abs(a.y), std::abs(a.z)}; }
[[nodiscard]] constexpr float max_component(Vec3 a) { return std::max(a.x, std::max(a.y, a.z)); }
[[nodiscard]] constexpr float min_component(Vec3 a) { return std::min(a.x, std::min(a.y, a.z)); }
[[nodiscard]] constexpr Vec3 lerp(Vec3 a, Vec3 b, float t) { return a + (b - a) * t; }
[[nodiscard]] constexpr float lerp(float a, float b, float t) { return a + (b - a) * t; }
[[nodiscard]] inline bool is_finite(Vec3 a) {
    return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}
[[nodiscard]] constexpr bool is_zero(Vec3 a) { return a.x == 0 && a.y == 0 && a.z == 0; }

/// Luminance of a linear colour with the primaries of sRGB (ITU-R BT.709).
[[nodiscard]] constexpr float luminance(Rgb c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

/// Mirror image of w about n; both point away from the surface. Requires: n of length one.
[[nodiscard]] constexpr Vec3 reflect(Vec3 w, Vec3 n) { return 2.0f * dot(w, n) * n - w; }

inline constexpr float k_pi = 3.14159265358979323846f;
inline constexpr float k_inv_pi = 0.31830988618379067154f;
inline constexpr float k_one_minus_epsilon = 0x1.fffffep-1f;  ///< Largest float below 1.

}  // namespace pathscope
