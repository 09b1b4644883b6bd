#pragma once
/// Typed, checked access to the fields of a map, with one error at the end instead of one at each step.
///
///     FieldReader fields(map, "CREDIT");
///     credit.session = fields.u64("session", 1);
///     credit.credits = fields.u32("credits", 0, 1024);
///     if (auto wrong = fields.error()) return *wrong;      // CREDIT: field 'credits' is missing.
///
/// The first thing that is wrong is kept; from then on fields return their least value. So a decoder is a
/// list of fields, and cannot forget a check. The sentence names the context and the field. Unknown keys are
/// no error, unless only() is asked for.
/// Cost: nothing is searched for when fields are read in the order in which they were written.
/// Convention: sizes of texts and bytes are in bytes. Requires: the map outlives the reader.
/// Thread safety: one thread.   Test: tests/wire/test_field_reader.cpp

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "pathscope/core/enum_names.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/wire/message_pack.hpp"

namespace pathscope {

class FieldReader {
  public:
    FieldReader(const PackMap& map, std::string context) : map_(&map), context_(std::move(context)) {}

    std::uint64_t u64(std::string_view name, std::uint64_t least = 0,
                      std::uint64_t most = std::numeric_limits<std::uint64_t>::max());
    std::uint32_t u32(std::string_view name, std::uint32_t least = 0,
                      std::uint32_t most = std::numeric_limits<std::uint32_t>::max());
    std::int64_t i64(std::string_view name, std::int64_t least = std::numeric_limits<std::int64_t>::min(),
                     std::int64_t most = std::numeric_limits<std::int64_t>::max());
    /// Finite. An integer is taken as well, as languages without floats of their own write 1 for 1.0.
    double f64(std::string_view name, double least = std::numeric_limits<double>::lowest(),
               double most = std::numeric_limits<double>::max());
    bool boolean(std::string_view name);
    // As long as the map lives.
    std::string_view text(std::string_view name, std::size_t min_bytes,
                          std::size_t max_bytes);  ///< Printable.
    std::string_view bytes(std::string_view name, std::size_t min_bytes, std::size_t max_bytes);
    const PackArray& array(std::string_view name, std::size_t max_items);
    const PackMap& map(std::string_view name);

    template <class E>
    E enumerator(std::string_view name) {
        const std::string_view word = text(name, 0, 256);
        if (error_) return E{};
        if (const auto value = from_name<E>(word)) return *value;
        fail(name, "is '" + std::string(word) + "', which is none of " + joined_names<E>(", "));
        return E{};
    }

    [[nodiscard]] bool has(std::string_view name) const { return map_->find(name) != nullptr; }

    /// Every key of the map must be one of these.
    void only(std::span<const std::string_view> names);

    /// For checks of the caller's own; the sentence becomes "CONTEXT: field 'name' <what>.".
    void fail(std::string_view name, std::string_view what);

    [[nodiscard]] const std::optional<Error>& error() const { return error_; }

  private:
    const PackValue* find(std::string_view name);
    template <class Kind>
    const Kind* as(std::string_view name, const PackValue& value, std::string_view expected);
    template <class Kind>
    const Kind* find_kind(std::string_view name, std::string_view expected);

    const PackMap* map_;
    std::size_t next_ = 0;  ///< The entry after the one that was found last.
    std::string context_;
    std::optional<Error> error_;
};

}  // namespace pathscope
