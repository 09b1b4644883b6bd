#include "pathscope/protocol/codec.hpp"

#include <set>

#include "pathscope/wire/message_pack.hpp"
#include "random_message.hpp"

#include "testing.hpp"

using namespace pathscope;
using testing::channel_of;
using testing::one_of_each;
using testing::receiver_of;

namespace {

Decoded decode_where_it_belongs(const Message& message, Frames frames) {
    return decode(std::move(frames), receiver_of(message), channel_of(message));
}

template <class E>
void check_names() {
    for (const auto& entry : enum_table(E{})) {
        CHECK(name_of(entry.value) == entry.name);
        CHECK(from_name<E>(entry.name) == entry.value);
    }
}

message::Lease some_lease() {
    message::Lease lease;
    lease.session = 77;
    lease.lease = LeaseId{501};
    lease.epoch = Epoch{3};
    lease.strategy = "blocks";
    lease.unit = 12;
    lease.rect = {64, 32, 32, 32};
    lease.first = 16;
    lease.count = 4;
    lease.lease_ms = 2000;
    return lease;
}

}  // namespace

TEST_CASE("every message comes back as it was, with random content at and within all limits") {
    HashRng rng(1);
    const int rounds = testing::k_sanitized ? 30 : 200;
    for (int i = 0; i < rounds; ++i)
        for (const Message& message : one_of_each(rng)) {
            CAPTURE(to_text(message));
            Decoded back = decode_where_it_belongs(message, encode(message));
            REQUIRE_MESSAGE(bool(back), back.error().sentence);
            REQUIRE(*back == message);
        }
}

TEST_CASE("the order of the table is that of the variant") {
    CHECK(name_of(type_of(message::Hello{})) == "HELLO");
    CHECK(name_of(type_of(message::Welcome{})) == "WELCOME");
    CHECK(name_of(type_of(message::Reject{})) == "REJECT");
    CHECK(name_of(type_of(message::Who{})) == "WHO");
    CHECK(name_of(type_of(message::SnapshotRequest{})) == "SNAPSHOT_REQUEST");
    CHECK(name_of(type_of(message::Snapshot{})) == "SNAPSHOT");
    CHECK(name_of(type_of(message::ManifestRequest{})) == "MANIFEST_REQUEST");
    CHECK(name_of(type_of(message::Manifest{})) == "MANIFEST");
    CHECK(name_of(type_of(message::PieceRequest{})) == "PIECE_REQUEST");
    CHECK(name_of(type_of(message::Piece{})) == "PIECE");
    CHECK(name_of(type_of(message::Ready{})) == "READY");
    CHECK(name_of(type_of(message::Ping{})) == "PING");
    CHECK(name_of(type_of(message::Pong{})) == "PONG");
    CHECK(name_of(type_of(message::Bye{})) == "BYE");
    CHECK(name_of(type_of(message::Input{})) == "INPUT");
    CHECK(name_of(type_of(message::Credit{})) == "CREDIT");
    CHECK(name_of(type_of(message::Lease{})) == "LEASE");
    CHECK(name_of(type_of(message::Tile{})) == "TILE");
    CHECK(name_of(type_of(message::Nack{})) == "NACK");
    CHECK(name_of(type_of(message::Cancel{})) == "CANCEL");
}

TEST_CASE("types and names are unique, and names of codes go both ways") {
    std::set<MessageType> types;
    std::set<std::string_view> names;
    for (const MessageInfo& info : k_message_table) {
        types.insert(info.type);
        names.insert(info.name);
        CHECK((info.payload == "-") == (info.max_payload_bytes == 0));
    }
    CHECK(types.size() == k_message_table.size());
    CHECK(names.size() == k_message_table.size());
    check_names<RejectCode>();
    check_names<ByeReason>();
    check_names<NackCode>();
    check_names<Channel>();
    check_names<Direction>();
    check_names<DecodeFault>();
}

TEST_CASE("a message is two frames, or three with a payload, and begins with the topic") {
    const Frames lease = encode(some_lease());
    REQUIRE(lease.size() == 2);
    CHECK(lease[0].size() == 4 + k_seal_bytes);
    CHECK(lease[0].starts_with("PS\x02\x31"));
    CHECK(lease[0].starts_with(k_input_topic));
    message::Input input;
    input.session = input.sequence = 1;
    input.changes = "changes";
    const Frames frames = encode(input);
    REQUIRE(frames.size() == 3);
    CHECK(frames[2] == "changes");
    CHECK(frames[0].starts_with(k_input_topic));
}

TEST_CASE(
    "S4: what a message is, its type says, whatever its size: that of an order to end, or of a camera") {
    // The sizes by which the classic system told its messages apart, in bytes.
    for (const std::size_t size : {28, 1, 2, 16, 48, 8, 4}) {
        message::Input input;
        input.session = input.sequence = 1;
        input.changes = std::string(size, 'x');  // As the path of a scene may be.
        Decoded back = decode(encode(input), Role::server, Channel::input);
        REQUIRE(bool(back));
        CHECK(std::get<message::Input>(*back).changes == input.changes);
        message::Bye bye{ByeReason::leaving, input.changes};
        back = decode(encode(bye), Role::server, Channel::monitor);
        REQUIRE(bool(back));
        CHECK(std::get<message::Bye>(*back) == bye);
        // Bare bytes of any of these sizes are nothing, with or without a head and wherever they come.
        for (const Channel channel : {Channel::input, Channel::monitor, Channel::frames}) {
            const Decoded bare = decode({input.changes}, Role::server, channel);
            REQUIRE_FALSE(bool(bare));
            CHECK(bare.error().fault == DecodeFault::foreign);
        }
        for (const MessageInfo& info : k_message_table) {
            Frames frames{"", std::string(size, 'x')};
            frames[0] = message_head(k_protocol_version, std::uint8_t(info.type), frames[1]);
            const Role reader = info.direction == Direction::to_client ? Role::client : Role::server;
            const Decoded sealed = decode(std::move(frames), reader, info.channel);
            REQUIRE_FALSE(bool(sealed));
            CHECK(sealed.error().fault == DecodeFault::malformed);
        }
    }
}

TEST_CASE("S6: a number is the same bytes on every machine, whatever the width of its own") {
    const auto bytes_of = [](std::uint64_t offset) {
        const std::string header = encode(message::PieceRequest{{}, offset, 1})[1];
        const std::size_t name = header.find("offset");
        return header.substr(name + 6, header.find("\xA6length") - name - 6);
    };
    using namespace std::string_literals;
    CHECK(bytes_of(0x7f) == "\x7f"s);
    CHECK(bytes_of(0x80) == "\xcc\x80"s);
    CHECK(bytes_of(0xffff) == "\xcd\xff\xff"s);
    CHECK(bytes_of(0x10000) == "\xce\x00\x01\x00\x00"s);
    CHECK(bytes_of(0xffffffff) == "\xce\xff\xff\xff\xff"s);
    CHECK(bytes_of(0x100000000) == "\xcf\x00\x00\x00\x01\x00\x00\x00\x00"s);
    // And a work order is told by its type, not by the bytes that it has.
    CHECK(type_of(some_lease()) == MessageType::lease);
    CHECK(encode(some_lease())[0][3] == char(MessageType::lease));
}

TEST_CASE("fields that are not known are ignored") {
    const Message lease = some_lease();
    Frames frames = encode(lease);
    PackMap map = *unpack(frames[1])->get<PackMap>();
    map.set("colour", "green");
    map.set("nested", PackArray{PackMap{}});
    frames[1] = pack(map);
    frames[0] = message_head(k_protocol_version, std::uint8_t(MessageType::lease), frames[1]);
    Decoded back = decode_where_it_belongs(lease, frames);
    REQUIRE(bool(back));
    CHECK(*back == lease);
}

TEST_CASE("free text is made printable and cut instead of being a bug") {
    message::Nack nack;
    nack.session = 1;
    nack.lease = LeaseId{1};
    nack.text = std::string(300, 'x') + "\n";
    Decoded back = decode(encode(nack), Role::client, Channel::frames);
    REQUIRE(bool(back));
    CHECK(std::get<message::Nack>(*back).text == std::string(256, 'x'));
    nack.text = "line\nbreak";
    back = decode(encode(nack), Role::client, Channel::frames);
    CHECK(std::get<message::Nack>(*back).text == "line?break");
}

TEST_CASE("a message is told as one line") {
    CHECK(to_text(some_lease()) ==
          "LEASE session=77 lease=501 epoch=3 strategy=blocks unit=12 rect=32x32+64+32 first=16 count=4 "
          "lease_ms=2000");
    CHECK(to_text(message::Bye{ByeReason::leaving, ""}) == "BYE reason=leaving text=\"\"");
    CHECK(to_text(message::Who{}) == "WHO");
    message::Piece piece;
    piece.bytes = "12345";
    CHECK(to_text(piece) == "PIECE hash=00000000 offset=0 total=0 payload=5B");
}

TEST_CASE("sockets learn from the table how large a frame may be") {
    CHECK(max_frame_bytes(Channel::monitor) == (8 << 20) + (64 << 10));
    CHECK(max_frame_bytes(Channel::frames) == (32 << 20) + (64 << 10));
}
