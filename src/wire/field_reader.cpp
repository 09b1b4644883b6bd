#include "pathscope/wire/field_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pathscope/wire/utf8.hpp"

namespace pathscope {
namespace {

/// Of an unsigned or signed number alike: is it within, and if not, how is that said?
template <class T>
std::string out_of_range(T value, T least, T most) {
    return fmt::format("is {}, which is not within {} and {}", value, least, most);
}

}  // namespace

void FieldReader::fail(std::string_view name, std::string_view what) {
    if (!error_) error_ = bad_input(fmt::format("{}: field '{}' {}.", context_, name, what));
}

const PackValue* FieldReader::find(std::string_view name) {
    const std::vector<PackEntry>& entries = map_->entries();
    if (next_ >= entries.size() || entries[next_].key != name) {
        next_ = std::size_t(std::ranges::find(entries, name, &PackEntry::key) - entries.begin());
        if (next_ == entries.size()) {
            fail(name, "is missing");
            return nullptr;
        }
    }
    return &entries[next_++].value;
}

template <class Kind>
const Kind* FieldReader::as(std::string_view name, const PackValue& value, std::string_view expected) {
    const Kind* kind = value.get<Kind>();
    if (!kind) fail(name, fmt::format("is {}, not {}", value.kind(), expected));
    return kind;
}

template <class Kind>
const Kind* FieldReader::find_kind(std::string_view name, std::string_view expected) {
    const PackValue* value = find(name);
    return value ? as<Kind>(name, *value, expected) : nullptr;
}

std::uint64_t FieldReader::u64(std::string_view name, std::uint64_t least, std::uint64_t most) {
    const PackValue* value = find(name);
    if (!value) return least;
    if (const auto* negative = value->get<std::int64_t>())
        fail(name, fmt::format("is {}, which is not within {} and {}", *negative, least, most));
    const auto* number = as<std::uint64_t>(name, *value, "integer");
    if (!number) return least;
    if (*number < least || *number > most) fail(name, out_of_range(*number, least, most));
    return std::clamp(*number, least, most);
}

std::uint32_t FieldReader::u32(std::string_view name, std::uint32_t least, std::uint32_t most) {
    return static_cast<std::uint32_t>(u64(name, least, most));
}

std::int64_t FieldReader::i64(std::string_view name, std::int64_t least, std::int64_t most) {
    const PackValue* value = find(name);
    if (!value) return least;
    if (const auto* number = value->get<std::uint64_t>()) {
        if (std::cmp_greater(*number, most))
            fail(name, fmt::format("is {}, above {}", *number, most));
        else if (std::cmp_less(*number, least))
            fail(name, fmt::format("is {}, below {}", *number, least));
        else
            return static_cast<std::int64_t>(*number);
        return least;
    }
    const auto* number = as<std::int64_t>(name, *value, "integer");
    if (!number) return least;
    if (*number < least || *number > most) fail(name, out_of_range(*number, least, most));
    return std::clamp(*number, least, most);
}

double FieldReader::f64(std::string_view name, double least, double most) {
    const PackValue* value = find(name);
    if (!value) return least;
    double number = 0;
    if (const auto* positive = value->get<std::uint64_t>())
        number = static_cast<double>(*positive);
    else if (const auto* negative = value->get<std::int64_t>())
        number = static_cast<double>(*negative);
    else if (const auto* real = as<double>(name, *value, "float"))
        number = *real;
    else
        return least;
    const bool within = number >= least && number <= most;  // False for NaN as well.
    if (!within) fail(name, out_of_range(number, least, most));
    return within ? number : least;
}

bool FieldReader::boolean(std::string_view name) {
    const auto* value = find_kind<bool>(name, "bool");
    return value && *value;
}

std::string_view FieldReader::text(std::string_view name, std::size_t min_bytes, std::size_t max_bytes) {
    const auto* value = find_kind<std::string>(name, "text");
    if (!value) return {};
    if (value->size() < min_bytes || value->size() > max_bytes)
        fail(name,
             fmt::format("has {} bytes, which is not within {} and {}", value->size(), min_bytes, max_bytes));
    else if (!is_printable_utf8(*value))
        fail(name, "holds control characters");
    else
        return *value;
    return {};
}

std::string_view FieldReader::bytes(std::string_view name, std::size_t min_bytes, std::size_t max_bytes) {
    const auto* value = find_kind<PackBytes>(name, "bytes");
    if (!value) return {};
    const std::size_t size = value->bytes.size();
    if (size < min_bytes || size > max_bytes)
        fail(name, fmt::format("has {} bytes, which is not within {} and {}", size, min_bytes, max_bytes));
    else
        return value->bytes;
    return {};
}

const PackArray& FieldReader::array(std::string_view name, std::size_t max_items) {
    static const PackArray k_empty;
    const auto* value = find_kind<PackArray>(name, "array");
    if (!value) return k_empty;
    if (value->size() <= max_items) return *value;
    fail(name, fmt::format("has {} items, more than {}", value->size(), max_items));
    return k_empty;
}

const PackMap& FieldReader::map(std::string_view name) {
    static const PackMap k_empty;
    const auto* value = find_kind<PackMap>(name, "map");
    return value ? *value : k_empty;
}

void FieldReader::only(std::span<const std::string_view> names) {
    for (const PackEntry& entry : map_->entries())
        if (std::ranges::find(names, entry.key) == names.end())
            fail(make_printable(entry.key, 64), "is not known");
}

}  // namespace pathscope
