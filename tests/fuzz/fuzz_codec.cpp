/// The pixel codecs: unpacking anything gives what was expected or a sentence, packing anything loses nothing.
///
///     bytes = codec words-expected(u16) packed        and, read anew from the first byte on, sums of either lossy format

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "fuzz_input.hpp"
#include "fuzz_target.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/image/wire_format.hpp"
#include "pathscope/wire/codec.hpp"

namespace pathscope::fuzz {
namespace {

void check_lossless(Codec codec, const std::string& raw) {
    const PackedBytes packed = pack_bytes(codec, raw);
    CHECK(packed.bytes.size() <= raw.size(), packed.bytes.size(), raw.size());
    const auto back = unpack_bytes(packed.codec, packed.bytes, raw.size());
    CHECK(bool(back), back.error().message);
    CHECK(*back == raw, raw.size());
}

/// Sums of a lossy format from any bytes: in range, and with an error of at most a step when they travel once more.
void read_any_rounded(WireFormat format, std::string_view bytes) {
    const std::size_t of_pixel = wire_bytes(format, 1) - wire_bytes(format, 0);
    if (bytes.size() < wire_bytes(format, 0)) return;
    const std::size_t pixels = (bytes.size() - wire_bytes(format, 0)) / of_pixel;
    for (const std::uint32_t samples : {1u, 4u, k_max_samples_per_pixel}) {
        std::vector<PixelSum> sums(pixels), again(pixels);
        const auto read =
            read_rounded_sums(format, bytes.substr(0, wire_bytes(format, pixels)), samples, sums);
        if (!read) {
            CHECK(!read.error().message.empty());
            continue;
        }
        std::int64_t brightest = 0;
        for (const PixelSum& sum : sums) {
            CHECK(in_range(sum, samples), sum.r, sum.g, sum.b);
            brightest = std::max({brightest, sum.r, sum.g, sum.b});
        }
        const auto back = read_rounded_sums(format, round_sums(format, sums), samples, again);
        CHECK(bool(back), back.error().message);
        for (std::size_t i = 0; i < pixels; ++i) {
            const std::int64_t largest = std::max({sums[i].r, sums[i].g, sums[i].b});
            CHECK(std::abs(sums[i].r - again[i].r) <= largest / 511 + (brightest >> 39), sums[i].r,
                  again[i].r);
        }
    }
}

void unpack_anything(std::string_view bytes) {
    for (const WireFormat format : {WireFormat::half, WireFormat::shared}) read_any_rounded(format, bytes);
    FuzzInput in(bytes);
    const Codec codec = k_codec_names[in.below(k_codec_names.size())].value;
    const std::size_t expected = 8 * (in.byte() + std::size_t{256} * in.byte());
    const auto raw = unpack_bytes(codec, std::string(in.rest()), expected);
    if (!raw) CHECK(!raw.error().message.empty());
    if (raw) CHECK(raw->size() == expected, raw->size(), expected);
    for (const auto& entry : k_codec_names) {
        if (raw) check_lossless(entry.value, *raw);
        check_lossless(entry.value, std::string(in.rest()));
    }
}

std::vector<std::string> seeds() {
    std::vector<std::string> seeds;
    for (const WireFormat format : {WireFormat::half, WireFormat::shared})
        for (const std::int64_t most :
             {std::int64_t{1}, std::int64_t{1} << 20, std::int64_t{1} << 40, k_max_quanta}) {
            std::vector<PixelSum> sums(9, {most, most / 3, 0});
            sums[1] = {1, most >> 30, most >> 15};
            seeds.push_back(round_sums(format, sums));
        }
    for (const std::size_t words : {0, 1, 2, 24, 192, 3072}) {
        std::string raw(8 * words, '\0');
        for (std::size_t i = 0; i < words; ++i) raw[8 * i] = char(7 * i), raw[8 * i + 3] = char(i / 3);
        for (const auto& entry : k_codec_names) {
            const PackedBytes packed = pack_bytes(entry.value, raw);
            if (packed.bytes.size() > 4000) continue;
            seeds.push_back({char(packed.codec), char(words % 256), char(words / 256)});
            seeds.back() += packed.bytes;
        }
    }
    return seeds;
}

const FuzzTarget k_target{"codec", unpack_anything, seeds};

}  // namespace
}  // namespace pathscope::fuzz
