#include <algorithm>

#include "fields.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/core/hash.hpp"
#include "pathscope/protocol/codec.hpp"
#include "pathscope/wire/message_pack.hpp"
#include "pathscope/wire/utf8.hpp"

namespace pathscope {
namespace {

/// Visitor that fills a header. A value beyond its limits is a bug of ours, so it is a CHECK.
class HeaderWriter {
  public:
    void u32(std::string_view name, std::uint32_t value, std::uint32_t least, std::uint32_t most) {
        u64(name, value, least, most);
    }
    void u64(std::string_view name, std::uint64_t value, std::uint64_t least, std::uint64_t most) {
        CHECK(value >= least && value <= most, name, value, least, most);
        map.set(name, value);
    }
    void time(std::string_view name, TimeNs value) {
        CHECK(value >= 0, name, value);
        map.set(name, value);
    }
    void text(std::string_view name, const std::string& value, std::size_t least, std::size_t most) {
        CHECK(value.size() >= least && value.size() <= most && is_printable_utf8(value), name, value);
        map.set(name, value);
    }
    void free_text(std::string_view name, const std::string& value, std::size_t most) {
        map.set(name, make_printable(value, most));
    }
    void bytes(std::string_view name, const std::string& value, std::size_t size) {
        CHECK(value.size() == size, name, value.size());
        map.set(name, PackBytes{value});
    }
    void hash(std::string_view name, const Digest& value) {
        map.set(name, PackBytes{std::string(value.begin(), value.end())});
    }
    template <class E>
    void word(std::string_view name, E value) {
        CHECK(from_name<E>(name_of(value)) == value, name);
        map.set(name, name_of(value));
    }
    void rect(std::string_view name, const PixelRect& r) {
        constexpr std::int64_t k_side = k_max_pixel;
        CHECK(r.x >= 0 && r.y >= 0 && !r.empty(), name, r);
        CHECK(std::int64_t{r.x} + r.width <= k_side && std::int64_t{r.y} + r.height <= k_side, name, r);
        map.set(name, PackArray{r.x, r.y, r.width, r.height});
    }
    void numbers(std::string_view name, const std::vector<std::uint64_t>& values, std::size_t most) {
        CHECK(values.size() <= most, name, values.size());
        map.set(name, PackArray(values.begin(), values.end()));
    }
    void samples(std::string_view name, const std::vector<DroppedSample>& values, std::size_t most) {
        CHECK(values.size() <= most, name, values.size());
        PackArray items;
        for (const DroppedSample& s : values) {
            CHECK(s.x < k_max_pixel && s.y < k_max_pixel, name, s.x, s.y);
            items.push_back(PackArray{s.x, s.y, s.sample});
        }
        map.set(name, std::move(items));
    }
    void payload(std::string& bytes) { frame = &bytes; }

    PackMap map;
    std::string* frame = nullptr;
};

}  // namespace

std::string message_head(std::uint8_t version, std::uint8_t type, std::string_view header) {
    std::string head{'P', 'S', static_cast<char>(version), static_cast<char>(type)};
    Hasher hasher;
    hasher.add(head);
    hasher.add(header);
    const Digest digest = hasher.finish();
    return head.append(digest.begin(), digest.begin() + k_seal_bytes);
}

Frames encode(Message message) {
    const MessageInfo& info = k_message_table[message.index()];
    HeaderWriter writer;
    std::visit(
        [&](auto& m) {
            describe(writer, m);
            const BrokenRule rule = broken_rule(m);
            CHECK(rule.what.empty(), info.name, rule.field, rule.what);
        },
        message);
    std::string header = pack(PackValue(std::move(writer.map)));
    Frames frames{message_head(k_protocol_version, std::uint8_t(info.type), header), std::move(header)};
    if (writer.frame) {
        CHECK(writer.frame->size() <= info.max_payload_bytes, info.name, writer.frame->size());
        frames.push_back(std::move(*writer.frame));
    }
    return frames;
}

}  // namespace pathscope
