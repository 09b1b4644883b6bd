#pragma once
/// One enum, one table: names of enumerators for command lines, messages and statistics.
///
///     enum class Roulette { constant, throughput };
///     constexpr std::array k_roulette_names{EnumName{Roulette::constant, "constant"}, ...};
///     constexpr const auto& enum_table(Roulette) { return k_roulette_names; }
///
/// name_of(Roulette::constant) == "constant"; from_name<Roulette>("constant") == Roulette::constant.
/// Test: tests/core/test_core.cpp walks a table both ways; each module walks its own with
/// check_enum_table().

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace pathscope {

template <class E>
struct EnumName {
    E value;
    std::string_view name;
};
template <class E>
EnumName(E, std::string_view) -> EnumName<E>;  // What C++20 deduces by itself; clang 14 does not yet.

template <class E>
[[nodiscard]] constexpr std::string_view name_of(E value) {
    for (const auto& entry : enum_table(E{}))
        if (entry.value == value) return entry.name;
    return "?";
}

template <class E>
[[nodiscard]] constexpr std::optional<E> from_name(std::string_view name) {
    for (const auto& entry : enum_table(E{}))
        if (entry.name == name) return entry.value;
    return std::nullopt;
}

/// "constant|throughput": for help texts and error sentences.
template <class E>
[[nodiscard]] std::string joined_names(std::string_view separator = "|") {
    std::string names;
    for (const auto& entry : enum_table(E{})) {
        if (!names.empty()) names += separator;
        names += entry.name;
    }
    return names;
}

}  // namespace pathscope
