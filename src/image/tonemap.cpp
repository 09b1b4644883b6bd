#include "pathscope/image/tonemap.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "pathscope/core/parallel_for.hpp"

namespace pathscope {
namespace {

double encode(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

/// The two pieces meet at 0.0031308, which encodes to 0.04045.
double decode(double encoded) {
    return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

/// Computed in double and rounded once: textures are decoded by this table, so it must have the same bits on every
/// machine, and the last bit of pow() may differ between two versions of the C library.
std::array<float, 256> make_decode_table() {
    std::array<float, 256> table;
    for (int code = 0; code < 256; ++code) table[std::size_t(code)] = float(decode(code / 255.0));
    return table;
}

/// Encoding to 8 bits without pow() and without branches: thresholds between neighbouring codes, and a guess from the
/// leading bits of the float. Buckets of bits are so narrow (128 per octave) that none holds two thresholds, so the
/// guess is right or one too low.
class Encoder8 {
  public:
    Encoder8() {
        for (int code = 1; code < 256; ++code) {
            const double exact = decode((code - 0.5) / 255);
            float threshold = float(exact);
            if (double(threshold) < exact) threshold = std::nextafter(threshold, 1.0f);
            thresholds_[std::size_t(code)] = threshold;
        }
        thresholds_[256] = 2;  // Beyond every input.
        for (std::size_t bucket = 0; bucket < k_buckets; ++bucket) {
            const float start = std::bit_cast<float>(std::uint32_t(bucket + k_first_bucket) << k_shift);
            int code = 0;
            while (start >= thresholds_[std::size_t(code) + 1]) ++code;
            guesses_[bucket] = std::uint8_t(code);
        }
    }

    std::uint8_t operator()(float linear) const {
        const float not_small = linear > k_smallest ? linear : k_smallest;  // NaN is not greater.
        const float x = std::min(not_small, k_one_minus_epsilon);
        const std::size_t guess = guesses_[(std::bit_cast<std::uint32_t>(x) >> k_shift) - k_first_bucket];
        return std::uint8_t(guess + (x >= thresholds_[guess + 1]));
    }

  private:
    static constexpr float k_smallest = 0x1p-13f;  // Encodes to 0.4 of code 1; all below is black too.
    static constexpr int k_shift = 16;             // Leaves the exponent and 7 bits of the fraction.
    static constexpr std::uint32_t k_first_bucket = std::bit_cast<std::uint32_t>(k_smallest) >> k_shift;
    static constexpr std::size_t k_buckets = (std::bit_cast<std::uint32_t>(1.0f) >> k_shift) - k_first_bucket;

    std::array<float, 257> thresholds_{};
    std::array<std::uint8_t, k_buckets> guesses_{};
};

const Encoder8& encoder8() {
    static const Encoder8 encoder;
    return encoder;
}

template <ToneCurve curve>
float apply_curve(float x) {
    if constexpr (curve == ToneCurve::reinhard) return x / (1 + x);
    if constexpr (curve == ToneCurve::filmic)
        return x * (2.51f * x + 0.03f) / (x * (2.43f * x + 0.59f) + 0.14f);
    return x;
}

/// One row, with the curve chosen outside of the loop.
template <ToneCurve curve>
void tone_map_row(std::span<const Rgb> row, float scale, std::size_t channels, std::uint8_t* out) {
    const Encoder8& encode8 = encoder8();
    // Squares of the largest half float are far inside a float's range, so no curve meets infinity / infinity.
    const auto channel = [&](float x) {
        return encode8(apply_curve<curve>(std::min(std::max(x, 0.0f), 65504.0f)));
    };
    for (const Rgb& radiance : row) {
        const Rgb x = radiance * scale;
        const bool not_a_number = std::isnan(x.x) || std::isnan(x.y) || std::isnan(x.z);
        out[0] = not_a_number ? 255 : channel(x.x);
        out[1] = not_a_number ? 0 : channel(x.y);
        out[2] = not_a_number ? 255 : channel(x.z);
        if (channels == 4) out[3] = 255;
        out += channels;
    }
}

void tone_map_row(std::span<const Rgb> row, const ToneMapParams& params, std::size_t channels,
                  std::uint8_t* out) {
    const float scale = std::exp2(params.exposure_ev);
    switch (params.curve) {
        case ToneCurve::linear:
            return tone_map_row<ToneCurve::linear>(row, scale, channels, out);
        case ToneCurve::reinhard:
            return tone_map_row<ToneCurve::reinhard>(row, scale, channels, out);
        case ToneCurve::filmic:
            return tone_map_row<ToneCurve::filmic>(row, scale, channels, out);
    }
}

}  // namespace

float encode_srgb(float linear) { return float(encode(double(linear))); }
std::uint8_t encode_srgb8(float linear) { return encoder8()(linear); }

float decode_srgb8(std::uint8_t code) {
    static const std::array<float, 256> table = make_decode_table();
    return table[code];
}

std::array<std::uint8_t, 3> tone_map(Rgb radiance, const ToneMapParams& params) {
    std::array<std::uint8_t, 3> pixel;
    tone_map_row({&radiance, 1}, params, 3, pixel.data());
    return pixel;
}

void tone_map(const Image& image, const ToneMapParams& params, int channels, Image8& out, int threads) {
    CHECK(channels == 3 || channels == 4, channels);
    const std::size_t row_bytes = std::size_t(image.width) * std::size_t(channels);
    out.width = image.width;
    out.height = image.height;
    out.channels = channels;
    out.bytes.resize(row_bytes * std::size_t(image.height));
    if (image.empty()) return;
    constexpr std::int64_t k_rows_per_piece = 16;
    parallel_for(
        image.height, threads,
        [&](int y) {
            tone_map_row(image.row(y), params, std::size_t(channels), &out.bytes[std::size_t(y) * row_bytes]);
        },
        k_rows_per_piece);
}

}  // namespace pathscope
