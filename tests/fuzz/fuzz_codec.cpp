/// The pixel codecs: unpacking anything gives what was expected or a sentence, packing anything loses nothing.
///
///     bytes = codec words-expected(u16) packed

#include <fmt/format.h>

#include "fuzz_input.hpp"
#include "fuzz_target.hpp"
#include "pathscope/core/check.hpp"
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

void unpack_anything(std::string_view bytes) {
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
