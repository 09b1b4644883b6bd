#pragma once
/// CHECK: a promise of the program to itself, on in every build.
///
/// A failed CHECK is a bug, never bad input: input is answered with a Result (result.hpp). It prints the
/// condition, the place and the values named after it, and aborts.
///
///     CHECK(first < count, first, count);
///
/// Thread safety: yes.

#include <sstream>
#include <string>

namespace pathscope {

[[noreturn]] void check_failed(const char* condition, const char* file, int line, const std::string& values);

namespace detail {
template <class... Values>
std::string describe_values([[maybe_unused]] const char* names, const Values&... values) {
    std::ostringstream text;
    if constexpr (sizeof...(Values) > 0) {
        text << names << " =";
        ((text << ' ' << values), ...);
    }
    return text.str();
}
}  // namespace detail
}  // namespace pathscope

#define CHECK(condition, ...)                                                                       \
    (static_cast<bool>(condition) ? void(0)                                                         \
                                  : ::pathscope::check_failed(#condition, __FILE__, __LINE__,       \
                                                              ::pathscope::detail::describe_values( \
                                                                  #__VA_ARGS__ __VA_OPT__(, ) __VA_ARGS__)))
