/// Every message, on every channel, for either side: what decodes is within all limits and comes back the same.
///
///     bytes = how role-and-channel ( raw frames / type version header payload / forged message )

#include "../protocol/random_message.hpp"
#include "forged_message.hpp"
#include "fuzz_target.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/wire/utf8.hpp"

namespace pathscope::fuzz {
namespace {

enum How { k_raw, k_sealed, k_forged, k_how_count };

Frames frames_of(FuzzInput& in, std::size_t how) {
    if (how == k_raw) return raw_frames(in);
    if (how == k_forged) return forged_message(in, 1);
    const std::uint8_t type = in.byte(), version = in.byte();
    const std::size_t header_bytes = in.byte() + 256u * in.byte();
    Frames frames = sealed(type, std::string(in.take(header_bytes)), version);
    const MessageInfo* info = find_message(type);
    if (info && info->max_payload_bytes > 0) frames.emplace_back(in.rest());
    return frames;
}

void check_message(Message message, Role receiver, Channel channel) {
    CHECK(!to_text(message).empty());
    const Message before = message;
    const Frames frames = encode(std::move(message));  // CHECKs every limit.
    Decoded again = decode(frames, receiver, channel);
    CHECK(bool(again), again.error().sentence);
    // REJECT, BYE and NACK carry free text, which is made printable on its way; it is so here, having been decoded.
    CHECK(*again == before, to_text(before));
    CHECK(encode(std::move(*again)) == frames, to_text(before));
}

void decode_anything(std::string_view bytes) {
    FuzzInput in(bytes);
    const std::size_t how = in.below(k_how_count);
    const std::uint8_t where = in.byte();
    const Frames frames = frames_of(in, how);
    const MessageInfo* info =
        frames.empty() || frames[0].size() < 4 ? nullptr : find_message(std::uint8_t(frames[0][3]));
    Role role = where % 2 == 0 ? Role::client : Role::server;
    Channel channel = k_channel_names[where / 2 % k_channel_names.size()].value;
    if (where < 0xE0 && info) {  // Mostly where it belongs.
        role = info->direction == Direction::to_client ? Role::client : Role::server;
        channel = info->channel;
    }
    Decoded decoded = decode(frames, role, channel);
    if (decoded) return check_message(std::move(*decoded), role, channel);
    CHECK(!decoded.error().sentence.empty());
    CHECK(is_printable_utf8(decoded.error().sentence), decoded.error().sentence);
}

std::vector<std::string> seeds() {
    std::vector<std::string> seeds;
    HashRng rng(1);
    for (int round = 0; round < 3; ++round)
        for (const Message& message : testing::one_of_each(rng)) {
            const Frames frames = encode(message);
            std::string seed{char(k_sealed), 0, frames[0][3], frames[0][2]};
            seed += {char(frames[1].size() % 256), char(frames[1].size() / 256)};
            seed += frames[1];
            if (frames.size() > 2) seed += frames[2];
            seeds.push_back(std::move(seed));
        }
    for (std::size_t type = 0; type < k_message_table.size(); ++type)
        seeds.push_back(std::string{char(k_forged), 0, char(type)} + std::string(60, '\x05'));
    return seeds;
}

const FuzzTarget k_target{"message", decode_anything, seeds};

}  // namespace
}  // namespace pathscope::fuzz
