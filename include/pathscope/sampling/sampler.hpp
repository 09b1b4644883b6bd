#pragma once
/// The random numbers of one sample of one pixel: a pure function of (seed, x, y, sample, dimension).
///
/// Why: nothing is drawn, so nothing can be drawn in another order. Any sample of any pixel replays anywhere
/// with the same bits, and the direct and the indirect pass of one sample share their numbers without either
/// computing those of the other.
///
/// Dimensions: a dimension d names a *pair* of numbers. get_2d(d) gives both, get_1d(d) the first of them, so
/// one number d serves one purpose: either as 1D or as 2D. Callers number their purposes 0, 1, 2, ... freely;
/// unused numbers cost nothing.
///
/// Kinds:
/// - independent: hashes; error falls with 1/sqrt(n) whatever the integrand.
/// - sobol: each pair of each pixel is an Owen-scrambled (0,2)-sequence in the sample number. The first 2^k
///   samples of a pair put exactly one point into every elementary interval of area 2^-k, so the error of
///   smooth integrands falls nearly with 1/n^1.5. Pairs (and pixels) are decorrelated by visiting the
///   sequence in differently scrambled order ("padding"), which keeps all of the above.
///
/// Sequences: samples [i, i + 1) * k_sequence_samples are sequence i. Sequences of one pixel are independent of each
/// other, as those of two pixels are: so one may decide how long another goes on, and not bias it (cluster/adaptive.hpp).
///
/// Units: floats uniform in [0, 1), multiples of 2^-24 (what tables of sampling/distribution.hpp count on).
/// See:   Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4); the scramble's constants are those
///        of Vegdahl 2021, "Building a Better LK Hash"; Laine & Karras 2011 had the idea.
/// Thread safety: a value.   Test: tests/sampling/test_sampler.cpp

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/math/random.hpp"
#include "pathscope/math/vec.hpp"

namespace pathscope {

enum class SamplerKind : std::uint8_t { independent, sobol };
inline constexpr std::array k_sampler_names{
    EnumName<SamplerKind>{SamplerKind::independent, "independent"},
    EnumName<SamplerKind>{SamplerKind::sobol, "sobol"},
};
constexpr const auto& enum_table(SamplerKind) { return k_sampler_names; }

inline constexpr std::uint32_t k_sequence_samples = 1u << 18;

template <Bits T>
[[nodiscard]] constexpr T reverse_bits(T x) {
    x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
    return (x >> 16) | (x << 16);
}

/// Owen's scramble of a number whose bits stand in reversed order: flips each bit by a hash of the bits below
/// it. Every step is a sum or a product of x, and those carry only upwards.
template <Bits T>
[[nodiscard]] constexpr T scramble_reversed(T x, std::type_identity_t<T> key) {
    x ^= x * 0x3d20adeau;
    x += key;
    x *= (key >> 16) | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return x;
}

/// The second coordinate of Sobol's sequence, bits reversed (the first, bits reversed, is the index itself).
/// Its generator matrix is Pascal's triangle modulo 2: output bit i is the parity of all index bits j whose
/// number contains i (Lucas: C(j, i) is odd iff the bits of i are among those of j). That parity over
/// supersets takes one step for each of the five bits of j, not one for each j.
template <Bits T>
[[nodiscard]] constexpr T sobol_second_reversed(T index) {
    index ^= (index & 0xffff0000u) >> 16;
    index ^= (index & 0xff00ff00u) >> 8;
    index ^= (index & 0xf0f0f0f0u) >> 4;
    index ^= (index & 0xccccccccu) >> 2;
    index ^= (index & 0xaaaaaaaau) >> 1;
    return index;
}

/// The pairs of four dimensions: x[i], y[i] belong to the i-th.
struct FourPairs {
    alignas(16) std::array<float, 4> x, y;

    [[nodiscard]] Vec2 operator[](std::size_t i) const { return {x[i], y[i]}; }
};

class PixelSampler {
  public:
    PixelSampler(SamplerKind kind, std::uint32_t seed, int x, int y, std::uint32_t sample)
        : kind_(kind),
          sample_(sample % k_sequence_samples),
          reversed_sample_(reverse_bits(sample_)),
          pixel_key_(hash_combine(
              hash_combine(hash_u32(seed + sample / k_sequence_samples * k_sequence_salt), std::uint32_t(x)),
              std::uint32_t(y))) {}

    [[nodiscard]] float get_1d(std::uint32_t dimension) const {
        return to_unit_float(pair(kind_, seed(), dimension).first);
    }

    [[nodiscard]] Vec2 get_2d(std::uint32_t dimension) const {
        const auto bits = pair(kind_, seed(), dimension);
        return {to_unit_float(bits.first), to_unit_float(bits.second)};
    }

    /// get_2d(first), ... get_2d(first + 3), for the price of one and a half.
    [[nodiscard]] FourPairs get_four_2d(std::uint32_t first) const {
        const Seed<FourBits> four{FourBits{} + pixel_key_, FourBits{} + sample_,
                                  FourBits{} + reversed_sample_};
        const auto bits = pair(kind_, four, FourBits{0, 1, 2, 3} + first);
        FourPairs pairs;
        for (std::size_t i = 0; i < 4; ++i) pairs.x[i] = to_unit_float(bits.first[i]);
        for (std::size_t i = 0; i < 4; ++i) pairs.y[i] = to_unit_float(bits.second[i]);
        return pairs;
    }

    [[nodiscard]] SamplerKind kind() const { return kind_; }

    /// What the numbers are made of, of one sample or of many.
    template <Bits T>
    struct Seed {
        T pixel_key, sample, reversed_sample;
    };
    [[nodiscard]] Seed<std::uint32_t> seed() const { return {pixel_key_, sample_, reversed_sample_}; }

    template <Bits T>
    struct Pair {
        T first, second;
    };
    /// The bits of get_2d(dimension): the upper 24 of each are the number.
    template <Bits T>
    [[nodiscard]] static Pair<T> pair(SamplerKind kind, const Seed<T>& seed,
                                      std::type_identity_t<T> dimension) {
        const T key = hash_combine(seed.pixel_key, dimension);
        if (kind == SamplerKind::independent) {
            const T first = hash_combine(key, seed.sample);
            return {first, hash_combine(first, T{} + k_second_salt)};
        }
        // Permutes the samples so that the first 2^k of them stay an aligned run of the sequence, for every k.
        const T index = reverse_bits(scramble_reversed(seed.reversed_sample, key));
        const auto scrambled = [&](T reversed, std::uint32_t salt) {
            return reverse_bits(scramble_reversed(reversed, hash_combine(key, T{} + salt)));
        };
        return {scrambled(index, k_first_salt), scrambled(sobol_second_reversed(index), k_second_salt)};
    }

  private:
    static constexpr std::uint32_t k_sequence_salt = 0x9e3779b1u;
    static constexpr std::uint32_t k_second_salt = 0x68bc21ebu;
    static constexpr std::uint32_t k_first_salt = 0x02e5be93u;

    SamplerKind kind_;
    std::uint32_t sample_, reversed_sample_;
    std::uint32_t pixel_key_;
};

}  // namespace pathscope
