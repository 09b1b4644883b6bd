/// doctest for our tests. Include it last, in a block of its own: doctest's CHECK then takes the place of
/// ours (core/check.hpp), which the headers above have used already.
/// That part has no include guard: where test files are compiled together, each begins with our CHECK.

#undef CHECK
#include <doctest/doctest.h>
#undef CHECK
#define CHECK(...) DOCTEST_CHECK(__VA_ARGS__)

#ifndef PATHSCOPE_TESTS_TESTING_HPP
#define PATHSCOPE_TESTS_TESTING_HPP

#include <filesystem>

#include "temporary_folder.hpp"

namespace pathscope::testing {

/// True while a sanitizer is compiled in: statistical tests take fewer samples then (never a wider
/// tolerance).
#ifdef PATHSCOPE_SANITIZED
inline constexpr bool k_sanitized = true;
#else
inline constexpr bool k_sanitized = false;
#endif

/// Folder of scenes by others, or empty where it is absent; a test then says "skipped: no ../shared" and
/// returns.
inline std::filesystem::path shared_folder() {
    const std::filesystem::path folder = "../shared";
    return std::filesystem::is_directory(folder) ? folder : std::filesystem::path{};
}

}  // namespace pathscope::testing

#endif
