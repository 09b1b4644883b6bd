/// Render states, their changes and manifests, as a server takes them from its client.
///
///     bytes = (state / changes / manifest) packed

#include "fuzz_input.hpp"
#include "fuzz_target.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/session/render_state.hpp"
#include "small_states.hpp"

namespace pathscope::fuzz {
namespace {

/// Requires: what decode_state() accepted.
void check_state(const RenderState& state) {
    const std::string packed = pack(PackValue(encode_state(state)));
    const auto value = unpack(packed, k_payload_limits);
    CHECK(bool(value), value.error().message);
    const auto again = decode_state(*value->get<PackMap>());
    CHECK(bool(again), again.error().message);
    CHECK(pack(PackValue(encode_state(*again))) == packed, packed.size());
    CHECK(state_changes(state, *again).size() == 0, packed.size());
}

void decode_anything(std::string_view bytes) {
    FuzzInput in(bytes);
    const std::size_t what = in.below(3);
    if (what == 2) {
        const auto manifest = unpack_manifest(in.rest());
        if (!manifest) return CHECK(!manifest.error().message.empty());
        const auto again = unpack_manifest(pack_manifest(*manifest));
        CHECK(bool(again), again.error().message);
        return CHECK(*again == *manifest, bytes.size());
    }
    const auto value = unpack(in.rest(), k_payload_limits);
    const PackMap* map = value ? value->get<PackMap>() : nullptr;
    if (!map) return;
    const auto state = what == 0 ? decode_state(*map) : apply_changes(small_state(0), *map);
    if (!state) return CHECK(!state.error().message.empty());
    check_state(*state);
}

std::vector<std::string> seeds() {
    std::vector<std::string> seeds;
    const RenderState first = small_state(0);
    for (std::size_t i = 0; i < k_small_states; ++i) {
        const RenderState state = small_state(i);
        seeds.push_back('\0' + pack(PackValue(encode_state(state))));
        const PackMap map = encode_state(state);
        for (const auto& [key, value] : map.entries()) {
            PackMap change;
            change.set(key, value);
            if (i == 0) seeds.push_back('\1' + pack(PackValue(change)));
        }
        seeds.push_back('\1' + pack(PackValue(state_changes(first, state))));
    }
    for (std::size_t i = 0; i < k_small_manifests; ++i)
        seeds.push_back('\2' + pack_manifest(small_manifest(i)));
    return seeds;
}

const FuzzTarget k_target{"render_state", decode_anything, seeds};

}  // namespace
}  // namespace pathscope::fuzz
