#pragma once
/// The numbers of many samples, a register full at a time. Included by one source file for each instruction set, after that file has
/// chosen it: pairs_portable.cpp, pairs_avx2.cpp, pairs_avx512.cpp.
///
/// The steps are those of sampler.hpp, for vectors of a length that no other file uses: so nothing that is compiled here for a
/// newer machine can take the place of what is compiled elsewhere for any.

#include <cstring>

#include "pathscope/sampling/sampler_batch.hpp"

namespace pathscope {

template <class Many>
struct UnitFloats;
template <>
struct UnitFloats<FourBits> {
    using Type = float __attribute__((vector_size(16)));
    using Whole = std::int32_t __attribute__((vector_size(16)));
};
template <>
struct UnitFloats<EightBits> {
    using Type = float __attribute__((vector_size(32)));
    using Whole = std::int32_t __attribute__((vector_size(32)));
};
template <>
struct UnitFloats<SixteenBits> {
    using Type = float __attribute__((vector_size(64)));
    using Whole = std::int32_t __attribute__((vector_size(64)));
};

template <class Many>
inline void get_pairs(const SamplerBatch& batch, std::uint32_t dimension, float* x, float* y) {
    using Floats = typename UnitFloats<Many>::Type;
    constexpr std::size_t lanes = sizeof(Many) / sizeof(std::uint32_t);
    static_assert(k_sampler_batch % lanes == 0);
    using Signed =
        typename UnitFloats<Many>::Whole;  // Conversions of these have an instruction of their own.
    const auto load = [](const std::uint32_t* from, Many& many) { std::memcpy(&many, from, sizeof many); };
    const auto store = [](float* to, const Many& bits) {
        const Floats units = __builtin_convertvector(Signed(bits >> 8), Floats) * 0x1p-24f;
        std::memcpy(to, &units, sizeof units);
    };
    for (std::size_t i = 0; i < batch.size; i += lanes) {
        PixelSampler::Seed<Many> seeds;
        load(&batch.pixel_key[i], seeds.pixel_key);
        load(&batch.sample[i], seeds.sample);
        load(&batch.reversed_sample[i], seeds.reversed_sample);
        const auto bits = PixelSampler::pair(batch.kind, seeds, Many{} + dimension);
        store(x + i, bits.first);
        store(y + i, bits.second);
    }
}

}  // namespace pathscope
