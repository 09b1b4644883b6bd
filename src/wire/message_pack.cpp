#include "pathscope/wire/message_pack.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "pathscope/core/check.hpp"
#include "pathscope/wire/utf8.hpp"

namespace pathscope {
namespace {

/// The first byte of a value. The "fix" forms hold a small number or length in their low bits.
namespace prefix {
constexpr std::uint8_t fixmap = 0x80, fixarray = 0x90, fixstr = 0xA0, negative_fixint = 0xE0;
constexpr std::uint8_t nil = 0xC0, false_ = 0xC2, true_ = 0xC3;
constexpr std::uint8_t bin8 = 0xC4, bin16 = 0xC5, bin32 = 0xC6;
constexpr std::uint8_t float32 = 0xCA, float64 = 0xCB;
constexpr std::uint8_t uint8 = 0xCC, uint16 = 0xCD, uint32 = 0xCE, uint64 = 0xCF;
constexpr std::uint8_t int8 = 0xD0, int16 = 0xD1, int32 = 0xD2, int64 = 0xD3;
constexpr std::uint8_t str8 = 0xD9, str16 = 0xDA, str32 = 0xDB;
constexpr std::uint8_t array16 = 0xDC, array32 = 0xDD, map16 = 0xDE, map32 = 0xDF;
}  // namespace prefix

template <class T>
constexpr std::uint64_t k_most = std::numeric_limits<T>::max();

/// Visits a value and all that is in it.
struct Packer {
    PackWriter out;

    void value(const PackValue& value) { std::visit(*this, value.variant()); }

    void operator()(std::monostate) { out.nil(); }
    void operator()(bool value) { out.boolean(value); }
    void operator()(double value) { out.real(value); }
    void operator()(std::uint64_t value) { out.integer(value); }
    void operator()(std::int64_t value) { out.integer(value); }
    void operator()(const std::string& text) { out.text(text); }
    void operator()(const PackBytes& value) { out.bytes(value.bytes); }
    void operator()(const PackArray& items) {
        out.array(items.size());
        for (const PackValue& item : items) value(item);
    }
    void operator()(const PackMap& map) {
        out.map(map.size());
        for (const PackEntry& entry : map.entries()) {
            out.text(entry.key);
            value(entry.value);
        }
    }
};

/// Recursive descent with a budget, into the place where a value is to be. After an error every function returns false or
/// nothing; the first sentence stays.
class Unpacker {
  public:
    Unpacker(std::string_view bytes, const PackLimits& limits)
        : in_(bytes), size_(bytes.size()), limits_(limits) {}

    Result<PackValue> whole() {
        if (size_ > limits_.max_bytes)
            return bad_input(fmt::format("{} bytes are more than the {} allowed.", size_, limits_.max_bytes));
        PackValue result;
        bool done = value(result, 0);
        if (done && in_.remaining() > 0) done = fail("bytes follow the value");
        if (!done) return bad_input(error_);
        return Result<PackValue>(std::move(result));
    }

  private:
    using MaybeSize = std::optional<std::size_t>;

    bool value(PackValue& out, std::size_t depth) {
        std::uint8_t first = 0;
        if (!start_element(first)) return false;
        if (first < prefix::fixmap) return put(out, first);
        if (first >= prefix::negative_fixint) return put(out, static_cast<std::int8_t>(first));
        if (first < prefix::fixarray) return map(out, first & 0x0F, depth);
        if (first < prefix::fixstr) return array(out, first & 0x0F, depth);
        if (const auto text = this->text(first)) return put(out, *text);
        return error_.empty() && long_form(out, first, depth);
    }

    bool long_form(PackValue& out, std::uint8_t first, std::size_t depth) {
        switch (first) {
            case prefix::nil:
                return put(out, PackValue());
            case prefix::false_:
                return put(out, false);
            case prefix::true_:
                return put(out, true);
            case prefix::bin8:
                return bytes(out, length<std::uint8_t>());
            case prefix::bin16:
                return bytes(out, length<std::uint16_t>());
            case prefix::bin32:
                return bytes(out, length<std::uint32_t>());
            case prefix::float32:
                return number<float, double>(out);
            case prefix::float64:
                return number<double>(out);
            case prefix::uint8:
                return number<std::uint8_t>(out);
            case prefix::uint16:
                return number<std::uint16_t>(out);
            case prefix::uint32:
                return number<std::uint32_t>(out);
            case prefix::uint64:
                return number<std::uint64_t>(out);
            case prefix::int8:
                return number<std::int8_t>(out);
            case prefix::int16:
                return number<std::int16_t>(out);
            case prefix::int32:
                return number<std::int32_t>(out);
            case prefix::int64:
                return number<std::int64_t>(out);
            case prefix::array16:
                return array(out, length<std::uint16_t>(), depth);
            case prefix::array32:
                return array(out, length<std::uint32_t>(), depth);
            case prefix::map16:
                return map(out, length<std::uint16_t>(), depth);
            case prefix::map32:
                return map(out, length<std::uint32_t>(), depth);
            default:
                return fail(fmt::format("prefix 0x{:02x} is of no supported type", first));
        }
    }

    template <class T>
    static bool put(PackValue& out, T&& value) {
        out = PackValue(std::forward<T>(value));
        return true;
    }

    bool start_element(std::uint8_t& first) {
        if (++elements_ > limits_.max_elements)
            return fail(fmt::format("more than {} elements", limits_.max_elements));
        const auto read = in_.big<std::uint8_t>();
        if (!read) return truncated();
        first = *read;
        return true;
    }

    template <class Read, class Keep = Read>
    bool number(PackValue& out) {
        const auto read = in_.big<Read>();
        return read ? put(out, static_cast<Keep>(*read)) : truncated();
    }

    template <class T>
    MaybeSize length() {
        if (const auto read = in_.big<T>()) return *read;
        truncated();
        return std::nullopt;
    }

    /// Nothing, without an error, if this prefix is not one of a text.
    std::optional<std::string_view> text(std::uint8_t first) {
        MaybeSize size;
        if (first >= prefix::fixstr && first < prefix::nil)
            size = first & 0x1F;
        else if (first == prefix::str8)
            size = length<std::uint8_t>();
        else if (first == prefix::str16)
            size = length<std::uint16_t>();
        else if (first == prefix::str32)
            size = length<std::uint32_t>();
        if (!size) return std::nullopt;

        const auto taken = in_.raw(*size);
        if (!taken)
            truncated();
        else if (!is_utf8(*taken))
            fail("a text is not UTF-8");
        return error_.empty() ? taken : std::nullopt;
    }

    bool bytes(PackValue& out, MaybeSize size) {
        if (!size) return false;
        const auto taken = in_.raw(*size);
        return taken ? put(out, PackBytes{std::string(*taken)}) : truncated();
    }

    /// A claim of more items than bytes are left is refused before anything is built for it.
    bool may_enter(MaybeSize items, std::size_t least_bytes_per_item, std::size_t depth) {
        if (!items) return false;
        if (depth >= limits_.max_depth)
            fail(fmt::format("nested deeper than {}", limits_.max_depth));
        else if (*items > in_.remaining() / least_bytes_per_item)
            truncated();
        return error_.empty();
    }

    bool array(PackValue& out, MaybeSize count, std::size_t depth) {
        if (!may_enter(count, 1, depth)) return false;
        PackArray items;
        items.reserve(std::min(*count, k_reserved));
        for (std::size_t i = 0; i < *count; ++i)
            if (!value(items.emplace_back(), depth + 1)) return false;
        return put(out, std::move(items));
    }

    bool map(PackValue& out, MaybeSize count, std::size_t depth) {
        if (!may_enter(count, 2, depth)) return false;
        std::vector<PackEntry> entries;
        entries.reserve(std::min(*count, k_reserved));
        for (std::size_t i = 0; i < *count; ++i) {
            PackEntry& entry = entries.emplace_back();
            if (!key(entry.key) || !value(entry.value, depth + 1)) return false;
        }
        auto map = PackMap::from_entries(std::move(entries));
        return map ? put(out, std::move(*map)) : fail("a map has a key twice");
    }

    bool key(std::string& out) {
        std::uint8_t first = 0;
        if (!start_element(first)) return false;
        const auto key = text(first);
        if (!key) return fail("a key is not text");
        out = *key;
        return true;
    }

    bool truncated() { return fail("the bytes end inside a value"); }

    /// False, for all to return.
    bool fail(std::string_view what) {
        if (error_.empty())
            error_ =
                fmt::format("Not MessagePack of ours: {} (before byte {}).", what, size_ - in_.remaining());
        return false;
    }

    /// Of a header, all; of what a claim alone would have us set aside, little.
    static constexpr std::size_t k_reserved = 32;

    ByteReader in_;
    std::size_t size_;
    PackLimits limits_;
    std::size_t elements_ = 0;
    std::string error_;
};

bool has_twins(const std::vector<PackEntry>& entries) {
    constexpr std::size_t k_few = 32;  // Comparing each with each is the quickest then.
    if (entries.size() <= k_few) {
        for (std::size_t i = 1; i < entries.size(); ++i)
            for (std::size_t j = 0; j < i; ++j)
                if (entries[i].key == entries[j].key) return true;
        return false;
    }
    // A peer may send a map of half a million keys.
    std::vector<std::string_view> keys;
    keys.reserve(entries.size());
    for (const PackEntry& entry : entries) keys.push_back(entry.key);
    std::ranges::sort(keys);
    return std::ranges::adjacent_find(keys) != keys.end();
}

}  // namespace

void PackMap::set(std::string_view key, PackValue value) {
    for (PackEntry& entry : entries_)
        if (entry.key == key) {
            entry.value = std::move(value);
            return;
        }
    entries_.push_back({std::string(key), std::move(value)});
}

PackMap::PackMap() = default;
PackMap::PackMap(const PackMap&) = default;
PackMap::PackMap(PackMap&&) noexcept = default;
PackMap& PackMap::operator=(const PackMap&) = default;
PackMap& PackMap::operator=(PackMap&&) noexcept = default;
PackMap::~PackMap() = default;

std::optional<PackMap> PackMap::from_entries(std::vector<PackEntry> entries) {
    if (has_twins(entries)) return std::nullopt;
    PackMap map;
    map.entries_ = std::move(entries);
    return map;
}

const PackValue* PackMap::find(std::string_view key) const {
    const auto found = std::ranges::find(entries_, key, &PackEntry::key);
    return found == entries_.end() ? nullptr : &found->value;
}

std::size_t PackMap::size() const { return entries_.size(); }

bool operator==(const PackMap& a, const PackMap& b) { return a.entries_ == b.entries_; }

std::string_view PackValue::kind() const {
    static constexpr std::string_view k_kinds[] = {"nil",  "bool",  "integer", "integer", "float",
                                                   "text", "bytes", "array",   "map"};
    static_assert(std::size(k_kinds) == std::variant_size_v<Variant>);
    return k_kinds[value_.index()];
}

std::string pack(const PackValue& value) {
    Packer packer;
    packer.value(value);
    return packer.out.take();
}

// ---- The writer.

void PackWriter::nil() { out_.big(prefix::nil); }

void PackWriter::boolean(bool value) { out_.big(value ? prefix::true_ : prefix::false_); }

void PackWriter::real(double value) { prefixed(prefix::float64, value); }

void PackWriter::integer(std::uint64_t value) {
    if (value < 0x80)
        out_.big(static_cast<std::uint8_t>(value));
    else if (value <= k_most<std::uint8_t>)
        prefixed(prefix::uint8, static_cast<std::uint8_t>(value));
    else if (value <= k_most<std::uint16_t>)
        prefixed(prefix::uint16, static_cast<std::uint16_t>(value));
    else if (value <= k_most<std::uint32_t>)
        prefixed(prefix::uint32, static_cast<std::uint32_t>(value));
    else
        prefixed(prefix::uint64, value);
}

void PackWriter::integer(std::int64_t value) {
    if (value >= 0)
        integer(static_cast<std::uint64_t>(value));
    else if (value >= -32)
        out_.big(static_cast<std::int8_t>(value));
    else if (value >= std::numeric_limits<std::int8_t>::min())
        prefixed(prefix::int8, static_cast<std::int8_t>(value));
    else if (value >= std::numeric_limits<std::int16_t>::min())
        prefixed(prefix::int16, static_cast<std::int16_t>(value));
    else if (value >= std::numeric_limits<std::int32_t>::min())
        prefixed(prefix::int32, static_cast<std::int32_t>(value));
    else
        prefixed(prefix::int64, value);
}

void PackWriter::text(std::string_view text) {
    CHECK(is_utf8(text), text.size());
    if (text.size() < 32)
        out_.big(static_cast<std::uint8_t>(prefix::fixstr | text.size()));
    else
        length(text.size(), prefix::str8, prefix::str16, prefix::str32);
    out_.raw(text);
}

void PackWriter::bytes(std::string_view bytes) {
    length(bytes.size(), prefix::bin8, prefix::bin16, prefix::bin32);
    out_.raw(bytes);
}

void PackWriter::array(std::size_t items) {
    if (items < 16)
        out_.big(static_cast<std::uint8_t>(prefix::fixarray | items));
    else
        length(items, std::nullopt, prefix::array16, prefix::array32);
}

void PackWriter::map(std::size_t entries) {
    if (entries < 16)
        out_.big(static_cast<std::uint8_t>(prefix::fixmap | entries));
    else
        length(entries, std::nullopt, prefix::map16, prefix::map32);
}

template <class T>
void PackWriter::prefixed(std::uint8_t first, T number) {
    out_.big(first);
    out_.big(number);
}

void PackWriter::length(std::size_t size, std::optional<std::uint8_t> form8, std::uint8_t form16,
                        std::uint8_t form32) {
    CHECK(size <= k_most<std::uint32_t>, size);
    if (form8 && size <= k_most<std::uint8_t>)
        prefixed(*form8, static_cast<std::uint8_t>(size));
    else if (size <= k_most<std::uint16_t>)
        prefixed(form16, static_cast<std::uint16_t>(size));
    else
        prefixed(form32, static_cast<std::uint32_t>(size));
}

Result<PackValue> unpack(std::string_view bytes, const PackLimits& limits) {
    return Unpacker(bytes, limits).whole();
}

}  // namespace pathscope
