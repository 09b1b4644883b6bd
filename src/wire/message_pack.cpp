#include "pathscope/wire/message_pack.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "pathscope/core/check.hpp"
#include "pathscope/wire/bytes.hpp"
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

class Packer {
  public:
    void value(const PackValue& value) { std::visit(*this, value.variant()); }
    std::string take() { return out_.take(); }

    void operator()(std::monostate) { out_.big(prefix::nil); }
    void operator()(bool value) { out_.big(value ? prefix::true_ : prefix::false_); }
    void operator()(double value) { prefixed(prefix::float64, value); }

    void operator()(std::uint64_t value) {
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

    /// Only negative ones: PackValue keeps the others as unsigned.
    void operator()(std::int64_t value) {
        if (value >= -32)
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

    void operator()(const std::string& text) {
        CHECK(is_utf8(text), text.size());
        if (text.size() < 32)
            out_.big(static_cast<std::uint8_t>(prefix::fixstr | text.size()));
        else
            length(text.size(), prefix::str8, prefix::str16, prefix::str32);
        out_.raw(text);
    }

    void operator()(const PackBytes& value) {
        length(value.bytes.size(), prefix::bin8, prefix::bin16, prefix::bin32);
        out_.raw(value.bytes);
    }

    void operator()(const PackArray& items) {
        if (items.size() < 16)
            out_.big(static_cast<std::uint8_t>(prefix::fixarray | items.size()));
        else
            length(items.size(), std::nullopt, prefix::array16, prefix::array32);
        for (const PackValue& item : items) value(item);
    }

    void operator()(const PackMap& map) {
        if (map.size() < 16)
            out_.big(static_cast<std::uint8_t>(prefix::fixmap | map.size()));
        else
            length(map.size(), std::nullopt, prefix::map16, prefix::map32);
        for (const PackEntry& entry : map.entries()) {
            (*this)(entry.key);
            value(entry.value);
        }
    }

  private:
    template <class T>
    void prefixed(std::uint8_t first, T number) {
        out_.big(first);
        out_.big(number);
    }

    void length(std::size_t size, std::optional<std::uint8_t> form8, std::uint8_t form16,
                std::uint8_t form32) {
        CHECK(size <= k_most<std::uint32_t>, size);
        if (form8 && size <= k_most<std::uint8_t>)
            prefixed(*form8, static_cast<std::uint8_t>(size));
        else if (size <= k_most<std::uint16_t>)
            prefixed(form16, static_cast<std::uint16_t>(size));
        else
            prefixed(form32, static_cast<std::uint32_t>(size));
    }

    ByteWriter out_;
};

/// Recursive descent with a budget. After an error every function returns nothing; its first sentence stays.
class Unpacker {
  public:
    Unpacker(std::string_view bytes, const PackLimits& limits)
        : in_(bytes), size_(bytes.size()), limits_(limits) {}

    Result<PackValue> whole() {
        if (size_ > limits_.max_bytes)
            return bad_input(fmt::format("{} bytes are more than the {} allowed.", size_, limits_.max_bytes));
        auto result = value(0);
        if (result && in_.remaining() > 0) result = fail("bytes follow the value");
        if (!result) return bad_input(error_);
        return std::move(*result);
    }

  private:
    using MaybeValue = std::optional<PackValue>;
    using MaybeSize = std::optional<std::size_t>;

    MaybeValue value(std::size_t depth) {
        const auto first = start_element();
        if (!first) return std::nullopt;
        if (*first < prefix::fixmap) return PackValue(*first);
        if (*first >= prefix::negative_fixint) return PackValue(static_cast<std::int8_t>(*first));
        if (*first < prefix::fixarray) return map(*first & 0x0F, depth);
        if (*first < prefix::fixstr) return array(*first & 0x0F, depth);
        if (const auto text = this->text(*first)) return PackValue(*text);
        if (!error_.empty()) return std::nullopt;
        return long_form(*first, depth);
    }

    MaybeValue long_form(std::uint8_t first, std::size_t depth) {
        switch (first) {
            case prefix::nil:
                return PackValue();
            case prefix::false_:
                return PackValue(false);
            case prefix::true_:
                return PackValue(true);
            case prefix::bin8:
                return bytes(length<std::uint8_t>());
            case prefix::bin16:
                return bytes(length<std::uint16_t>());
            case prefix::bin32:
                return bytes(length<std::uint32_t>());
            case prefix::float32:
                return number<float, double>();
            case prefix::float64:
                return number<double>();
            case prefix::uint8:
                return number<std::uint8_t>();
            case prefix::uint16:
                return number<std::uint16_t>();
            case prefix::uint32:
                return number<std::uint32_t>();
            case prefix::uint64:
                return number<std::uint64_t>();
            case prefix::int8:
                return number<std::int8_t>();
            case prefix::int16:
                return number<std::int16_t>();
            case prefix::int32:
                return number<std::int32_t>();
            case prefix::int64:
                return number<std::int64_t>();
            case prefix::array16:
                return array(length<std::uint16_t>(), depth);
            case prefix::array32:
                return array(length<std::uint32_t>(), depth);
            case prefix::map16:
                return map(length<std::uint16_t>(), depth);
            case prefix::map32:
                return map(length<std::uint32_t>(), depth);
            default:
                return fail(fmt::format("prefix 0x{:02x} is of no supported type", first));
        }
    }

    std::optional<std::uint8_t> start_element() {
        if (++elements_ > limits_.max_elements)
            return fail(fmt::format("more than {} elements", limits_.max_elements));
        const auto first = in_.big<std::uint8_t>();
        if (!first) return truncated();
        return first;
    }

    template <class Read, class Keep = Read>
    MaybeValue number() {
        const auto read = in_.big<Read>();
        if (!read) return truncated();
        return PackValue(static_cast<Keep>(*read));
    }

    template <class T>
    MaybeSize length() {
        const auto read = in_.big<T>();
        if (!read) return truncated();
        return *read;
    }

    /// Nothing, without an error, if this prefix is not one of a text.
    std::optional<std::string> text(std::uint8_t first) {
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
        if (!taken) return truncated();
        if (!is_utf8(*taken)) return fail("a text is not UTF-8");
        return std::string(*taken);
    }

    MaybeValue bytes(MaybeSize size) {
        if (!size) return std::nullopt;
        const auto taken = in_.raw(*size);
        if (!taken) return truncated();
        return PackValue(PackBytes{std::string(*taken)});
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

    MaybeValue array(MaybeSize count, std::size_t depth) {
        if (!may_enter(count, 1, depth)) return std::nullopt;
        PackArray items;
        for (std::size_t i = 0; i < *count; ++i) {
            auto item = value(depth + 1);
            if (!item) return std::nullopt;
            items.push_back(std::move(*item));
        }
        return PackValue(std::move(items));
    }

    MaybeValue map(MaybeSize count, std::size_t depth) {
        if (!may_enter(count, 2, depth)) return std::nullopt;
        std::vector<PackEntry> entries;
        for (std::size_t i = 0; i < *count; ++i) {
            auto key = this->key();
            if (!key) return std::nullopt;
            auto item = value(depth + 1);
            if (!item) return std::nullopt;
            entries.push_back({std::move(*key), std::move(*item)});
        }
        auto map = PackMap::from_entries(std::move(entries));
        if (!map) return fail("a map has a key twice");
        return PackValue(std::move(*map));
    }

    std::optional<std::string> key() {
        const auto first = start_element();
        if (!first) return std::nullopt;
        auto key = text(*first);
        if (!key) fail("a key is not text");
        return key;
    }

    std::nullopt_t truncated() { return fail("the bytes end inside a value"); }

    std::nullopt_t fail(std::string_view what) {
        if (error_.empty())
            error_ =
                fmt::format("Not MessagePack of ours: {} (before byte {}).", what, size_ - in_.remaining());
        return std::nullopt;
    }

    ByteReader in_;
    std::size_t size_;
    PackLimits limits_;
    std::size_t elements_ = 0;
    std::string error_;
};

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
    // By sorting, not by looking each key up: a peer may send a map of half a million keys.
    std::vector<std::string_view> keys;
    keys.reserve(entries.size());
    for (const PackEntry& entry : entries) keys.push_back(entry.key);
    std::ranges::sort(keys);
    if (std::ranges::adjacent_find(keys) != keys.end()) return std::nullopt;

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
    return packer.take();
}

Result<PackValue> unpack(std::string_view bytes, const PackLimits& limits) {
    return Unpacker(bytes, limits).whole();
}

}  // namespace pathscope
