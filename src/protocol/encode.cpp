#include <initializer_list>
#include <utility>

#include "fields.hpp"
#include "pathscope/core/check.hpp"
#include "pathscope/core/hash.hpp"
#include "pathscope/protocol/codec.hpp"
#include "pathscope/wire/message_pack.hpp"
#include "pathscope/wire/utf8.hpp"

namespace pathscope {
namespace {

/// Visitor that writes a header. A value beyond its limits is a bug of ours, so it is a CHECK.
class HeaderWriter {
  public:
    HeaderWriter() { fields_.reserve(k_usual_bytes); }

    void u32(std::string_view name, std::uint32_t value, std::uint32_t least, std::uint32_t most) {
        u64(name, value, least, most);
    }
    void u64(std::string_view name, std::uint64_t value, std::uint64_t least, std::uint64_t most) {
        CHECK(value >= least && value <= most, name, value, least, most);
        field(name).integer(value);
    }
    /// Left out where it says no more than its absence.
    void optional_u32(std::string_view name, std::uint32_t value, std::uint32_t least, std::uint32_t most,
                      std::uint32_t absent) {
        if (value != absent) u64(name, value, least, most);
    }
    void time(std::string_view name, TimeNs value) {
        CHECK(value >= 0, name, value);
        field(name).integer(value);
    }
    void text(std::string_view name, const std::string& value, std::size_t least, std::size_t most) {
        CHECK(value.size() >= least && value.size() <= most && is_printable_utf8(value), name, value);
        field(name).text(value);
    }
    void free_text(std::string_view name, const std::string& value, std::size_t most) {
        field(name).text(make_printable(value, most));
    }
    void bytes(std::string_view name, const std::string& value, std::size_t size) {
        CHECK(value.size() == size, name, value.size());
        field(name).bytes(value);
    }
    void hash(std::string_view name, const Digest& value) {
        field(name).bytes({reinterpret_cast<const char*>(value.data()), value.size()});
    }
    template <class E>
    void word(std::string_view name, E value) {
        CHECK(from_name<E>(name_of(value)) == value, name);
        field(name).text(name_of(value));
    }
    void rect(std::string_view name, const PixelRect& r) {
        constexpr std::int64_t k_side = k_max_pixel;
        CHECK(r.x >= 0 && r.y >= 0 && !r.empty(), name, r);
        CHECK(std::int64_t{r.x} + r.width <= k_side && std::int64_t{r.y} + r.height <= k_side, name, r);
        numbers_of(field(name), {r.x, r.y, r.width, r.height});
    }
    void numbers(std::string_view name, const std::vector<std::uint64_t>& values, std::size_t most) {
        CHECK(values.size() <= most, name, values.size());
        field(name).array(values.size());
        for (const std::uint64_t value : values) fields_.integer(value);
    }
    void samples(std::string_view name, const std::vector<DroppedSample>& values, std::size_t most) {
        CHECK(values.size() <= most, name, values.size());
        field(name).array(values.size());
        for (const DroppedSample& s : values) {
            CHECK(s.x < k_max_pixel && s.y < k_max_pixel, name, s.x, s.y);
            numbers_of(fields_, {s.x, s.y, s.sample});
        }
    }
    void payload(std::string& bytes) { frame = &bytes; }

    [[nodiscard]] std::string header() const {
        PackWriter header;
        header.reserve(k_most_map_bytes + fields_.size());
        header.map(count_);
        header.append(fields_);
        return header.take();
    }

    std::string* frame = nullptr;

  private:
    static constexpr std::size_t k_usual_bytes = 256;   ///< Of a header.
    static constexpr std::size_t k_most_map_bytes = 5;  ///< Before its first key.

    /// Names the next field; its value has to follow.
    PackWriter& field(std::string_view name) {
        ++count_;
        fields_.text(name);
        return fields_;
    }
    static void numbers_of(PackWriter& out, std::initializer_list<std::int64_t> numbers) {
        out.array(numbers.size());
        for (const std::int64_t number : numbers) out.integer(number);
    }

    PackWriter fields_;
    std::size_t count_ = 0;
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
    std::string header = writer.header();
    Frames frames;
    frames.reserve(3);
    frames.push_back(message_head(k_protocol_version, std::uint8_t(info.type), header));
    frames.push_back(std::move(header));
    if (writer.frame) {
        CHECK(writer.frame->size() <= info.max_payload_bytes, info.name, writer.frame->size());
        frames.push_back(std::move(*writer.frame));
    }
    return frames;
}

}  // namespace pathscope
