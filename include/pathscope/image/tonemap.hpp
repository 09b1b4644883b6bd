#pragma once
/// From radiance to a screen: exposure, a curve, and the sRGB encoding.
///
///   v = encode(curve(L * 2^exposure_ev))
///   curve:  linear   x                                                        (clipped at 1)
///           reinhard x / (1 + x)                                              (Reinhard et al. 2002, eq. 3)
///           filmic   x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14)           (Narkowicz 2015, a fit of
///           ACES)
///   encode: 12.92 x up to 0.0031308, 1.055 x^(1/2.4) - 0.055 above            (IEC 61966-2-1)
///
/// Why: a screen shows a contrast of some 1:1000, and expects it encoded. Channels are treated alike and
/// alone. What cannot be shown is not hidden: NaN becomes magenta, which no curve gives by itself; negative
/// is black, and +infinity white. Units: exposure in stops (EV); one more doubles the light. Source: K.
/// Narkowicz 2015, "ACES Filmic Tone Mapping Curve"; E. Reinhard et al. 2002, "Photographic Tone
///         Reproduction for Digital Images". Thread safety: yes.   Test: tests/image/test_tonemap.cpp

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/image/image.hpp"

namespace pathscope {

enum class ToneCurve { linear, reinhard, filmic };
inline constexpr std::array k_tone_curve_names{EnumName<ToneCurve>{ToneCurve::linear, "linear"},
                                               EnumName<ToneCurve>{ToneCurve::reinhard, "reinhard"},
                                               EnumName<ToneCurve>{ToneCurve::filmic, "filmic"}};
constexpr const auto& enum_table(ToneCurve) { return k_tone_curve_names; }

struct ToneMapParams {
    float exposure_ev = 0;
    ToneCurve curve = ToneCurve::filmic;
};

/// sRGB encoding of a display-linear value, as a real number; its inverse; and both for the 8-bit codes of
/// files and screens. encode_srgb8 is correctly rounded, clamps to [0, 1], and takes NaN as 0.
/// decode_srgb decodes textures, so it has the same bits on every machine: the power is a polynomial in the square root, of least
/// relative error, x^2.4 = s^4.8 with s = sqrt(x). Error: below 2.5e-6 of the value. Requires: encoded in [0, 1].
[[nodiscard]] float encode_srgb(float linear);
[[nodiscard]] inline float decode_srgb(float encoded) {
    constexpr float k_coefficients[] = {-4.076645465e-2f, 8.277062132e-1f,  2.830050325e-1f, -8.899743618e-2f,
                                        2.210211562e-2f,  -3.260399979e-3f, 2.095088479e-4f};
    const float s = std::sqrt((encoded + 0.055f) * (1 / 1.055f));
    float power = 0;
    for (const float coefficient : k_coefficients) power = power * s + coefficient;
    return encoded <= 0.04045f ? encoded * (1 / 12.92f) : std::min(power, 1.0f);
}
[[nodiscard]] std::uint8_t encode_srgb8(float linear);
[[nodiscard]] float decode_srgb8(std::uint8_t code);

/// One pixel, ready for the screen.
[[nodiscard]] std::array<std::uint8_t, 3> tone_map(Rgb radiance, const ToneMapParams& params);

/// A whole picture into `out`, whose memory is used again when it is large enough. channels: 3 or 4 (alpha
/// 255).
void tone_map(const Image& image, const ToneMapParams& params, int channels, Image8& out, int threads = 0);

}  // namespace pathscope
