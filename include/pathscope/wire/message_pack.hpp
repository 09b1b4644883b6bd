#pragma once
/// MessagePack, the part of it that headers and the render state need.
///
///     PackMap map;                                        // {"epoch": 3, "name": "a"}
///     map.set("epoch", 3u);
///     map.set("name", "a");
///     const std::string bytes = pack(PackValue(map));
///     const Result<PackValue> back = unpack(bytes);       // *back == PackValue(map)
///
/// Kinds: nil, bool, integers of 64 bits, floats of 64 bits, text (UTF-8), bytes, arrays, maps with text
/// keys.
/// Canonical: one value has one encoding (shortest integers and lengths, floats as 64 bits, keys in the order
/// they were set), so that hashes of packed values are hashes of values. unpack() accepts the longer forms
/// too.
/// Invariant: a key is at most once in a map; an integer that is not negative is kept as unsigned, so that
/// equal numbers are equal values.
/// Why not a library: fifteen prefixes are less code than a dependency, and every limit below is ours to
/// test.
/// Source: github.com/msgpack/msgpack/blob/master/spec.md. Extension types are refused.
/// Thread safety: as std::string.   Test: tests/wire/test_message_pack.cpp

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/wire/bytes.hpp"

namespace pathscope {

class PackValue;
struct PackEntry;
using PackArray = std::vector<PackValue>;

/// A string of bytes, where std::string alone would mean text.
struct PackBytes {
    std::string bytes;
    bool operator==(const PackBytes&) const = default;
};

/// Keys in the order they were set. Lookup is linear: maps here have a few dozen keys.
class PackMap {
  public:
    // Defined where entries are complete, which a variant that holds a map asks for earlier.
    PackMap();
    PackMap(const PackMap&);
    PackMap(PackMap&&) noexcept;
    PackMap& operator=(const PackMap&);
    PackMap& operator=(PackMap&&) noexcept;
    ~PackMap();

    /// Nothing if a key is there twice.
    [[nodiscard]] static std::optional<PackMap> from_entries(std::vector<PackEntry> entries);

    void set(std::string_view key, PackValue value);  ///< Replaces the value of a key that is there already.
    [[nodiscard]] const PackValue* find(std::string_view key) const;  ///< Null if absent.
    [[nodiscard]] const std::vector<PackEntry>& entries() const { return entries_; }
    [[nodiscard]] std::size_t size() const;
    friend bool operator==(const PackMap& a, const PackMap& b);

  private:
    std::vector<PackEntry> entries_;
};

class PackValue {
  public:
    using Variant = std::variant<std::monostate, bool, std::uint64_t, std::int64_t, double, std::string,
                                 PackBytes, PackArray, PackMap>;

    PackValue() = default;           ///< nil
    template <std::same_as<bool> T>  // A template, because any pointer converts to a plain bool.
    PackValue(T value) : value_(value) {}
    template <std::unsigned_integral T>
    requires(!std::same_as<T, bool>) PackValue(T value) : value_(std::uint64_t{value}) {}
    template <std::signed_integral T>
    PackValue(T value)
        : value_(value < 0 ? Variant(std::int64_t{value}) : Variant(static_cast<std::uint64_t>(value))) {}
    PackValue(double value) : value_(value) {}
    PackValue(std::string text) : value_(std::move(text)) {}
    PackValue(std::string_view text) : value_(std::string(text)) {}
    PackValue(const char* text) : value_(std::string(text)) {}
    PackValue(PackBytes bytes) : value_(std::move(bytes)) {}
    PackValue(PackArray array) : value_(std::move(array)) {}
    PackValue(PackMap map) : value_(std::move(map)) {}

    /// Null unless the value is of that kind: get<std::string>(), get<PackMap>()...
    template <class Kind>
    [[nodiscard]] const Kind* get() const {
        return std::get_if<Kind>(&value_);
    }
    [[nodiscard]] const Variant& variant() const { return value_; }
    [[nodiscard]] std::string_view kind() const;  ///< "nil", "bool", "integer", "float", "text", "bytes"...
    bool operator==(const PackValue&) const = default;

  private:
    Variant value_;
};

struct PackEntry {
    std::string key;
    PackValue value;
    bool operator==(const PackEntry&) const = default;
};

/// Bounds on what unpack() builds. The size of the input bounds nothing by itself: five bytes can claim an
/// array of four thousand million items, and nesting costs stack.
struct PackLimits {
    std::size_t max_bytes = 64 << 10;  ///< Of the whole input.
    std::size_t max_depth = 8;         ///< Arrays and maps inside each other.
    std::size_t max_elements = 4096;   ///< Values, keys included, in all.
};

inline constexpr PackLimits k_header_limits{};
inline constexpr PackLimits k_payload_limits{8 << 20, 8, 1 << 20};

/// Requires: text is UTF-8, texts and bytes are shorter than 2^32.
[[nodiscard]] std::string pack(const PackValue& value);

/// The same bytes without a PackValue, for what is said ten thousand times a second:
///
///     PackWriter out;                      // {"epoch": 3}
///     out.map(1);
///     out.text("epoch");
///     out.integer(std::uint64_t{3});
///
/// Requires: after array(n), n values follow; after map(n), n times a text that is the key, and a value; no key twice.
class PackWriter {
  public:
    void nil();
    void boolean(bool value);
    void integer(std::uint64_t value);
    void integer(std::int64_t value);
    void real(double value);
    void text(std::string_view text);
    void bytes(std::string_view bytes);
    void array(std::size_t items);
    void map(std::size_t entries);
    void append(const PackWriter& more) { out_.raw(more.out_.bytes()); }

    void reserve(std::size_t bytes) { out_.reserve(bytes); }
    [[nodiscard]] std::size_t size() const { return out_.bytes().size(); }
    [[nodiscard]] std::string take() { return out_.take(); }

  private:
    template <class T>
    void prefixed(std::uint8_t first, T number);
    void length(std::size_t size, std::optional<std::uint8_t> form8, std::uint8_t form16,
                std::uint8_t form32);

    ByteWriter out_;
};

/// Exactly one value and nothing after it. The sentence says what is wrong, and at which byte.
[[nodiscard]] Result<PackValue> unpack(std::string_view bytes, const PackLimits& limits = k_header_limits);

}  // namespace pathscope
