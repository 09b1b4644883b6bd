/// MessagePack: whatever unpacks packs again, and has one encoding from then on.
///
///     bytes = limits value

#include "../protocol/random_message.hpp"
#include "fuzz_input.hpp"
#include "fuzz_target.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/protocol/codec.hpp"
#include "pathscope/wire/message_pack.hpp"

namespace pathscope::fuzz {
namespace {

void unpack_anything(std::string_view bytes) {
    FuzzInput in(bytes);
    const auto value = unpack(in.rest(), in.flag() ? k_payload_limits : k_header_limits);
    if (!value) return CHECK(!value.error().message.empty());
    const std::string canonical = pack(*value);
    CHECK(canonical.size() <= 2 * bytes.size(), canonical.size(), bytes.size());  // A float may double.
    const auto again = unpack(canonical, k_payload_limits);
    CHECK(bool(again), again.error().message);
    CHECK(pack(*again) == canonical, bytes.size());
}

std::vector<std::string> seeds() {
    std::vector<std::string> seeds;
    HashRng rng(2);
    for (const Message& message : testing::one_of_each(rng)) seeds.push_back('\1' + encode(message)[1]);
    // One of each prefix, with a length or a number of zeros; and the longest that can be claimed.
    for (int prefix = 0x80; prefix < 0x100; prefix += prefix < 0xC0 ? 16 : 1) {
        seeds.push_back(std::string{'\1', char(prefix)} + std::string(8, '\0'));
        seeds.push_back(std::string{'\1', char(prefix)} + std::string(8, '\xff'));
    }
    return seeds;
}

const FuzzTarget k_target{"message_pack", unpack_anything, seeds};

}  // namespace
}  // namespace pathscope::fuzz
