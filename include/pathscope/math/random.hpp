#pragma once
/// Random numbers as a pure function of what they are for: hash(seed, pixel, sample, dimension).
///
/// Why: no generator state crosses pixels, threads or machines, so that any sample of any pixel can be
/// replayed anywhere and gives the same bits. Units: floats are uniform in [0, 1) with 24 bits. Source: the
/// 32-bit finaliser is lowbias32 (C. Wellons 2018, found by hash prospector); combining is by
///         multiply-add with odd constants before it.
/// Test: tests/math/test_math.cpp (bit balance, avalanche)

#include <concepts>
#include <cstdint>
#include <type_traits>

namespace pathscope {

/// 32-bit numbers for one instruction: what is written for one number can be asked for many.
using FourBits = std::uint32_t __attribute__((vector_size(16)));
using EightBits = std::uint32_t __attribute__((vector_size(32)));
using SixteenBits = std::uint32_t __attribute__((vector_size(64)));

template <class T>
concept Bits = std::same_as<T, std::uint32_t> || std::same_as<T, FourBits> || std::same_as<T, EightBits> ||
    std::same_as<T, SixteenBits>;

/// A bijection of 32-bit numbers that spreads each input bit over all output bits.
template <Bits T>
[[nodiscard]] constexpr T hash_u32(T x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}

/// Mixes a further value into a hash; the order of arguments matters.
template <Bits T>
[[nodiscard]] constexpr T hash_combine(T hash, std::type_identity_t<T> value) {
    return hash_u32(hash * 0x9e3779b1u + value + 0x7f4a7c15u);
}

/// The upper 24 bits as a float in [0, 1).
[[nodiscard]] constexpr float to_unit_float(std::uint32_t bits) { return float(bits >> 8) * 0x1p-24f; }

/// A small counter-based generator for tests and tools; renderers take their numbers from
/// sampling/sampler.hpp.
class HashRng {
  public:
    explicit HashRng(std::uint32_t seed) : key_(hash_u32(seed)) {}
    std::uint32_t next_u32() {
        const std::uint32_t count = counter_++;
        return hash_combine(hash_combine(key_, count >> 16), count);
    }
    float next_float() { return to_unit_float(next_u32()); }

  private:
    std::uint32_t key_;
    std::uint32_t counter_ = 0;
};

}  // namespace pathscope
