#pragma once
/// doctest for our tests. Include it last, in a block of its own: doctest's CHECK then takes the place of
/// ours (core/check.hpp), which the headers above have used already.

#undef CHECK
#include <doctest/doctest.h>

#include <filesystem>
#include <string>

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

/// A fresh folder, removed with everything in it at the end of the scope.
class TemporaryFolder {
  public:
    TemporaryFolder() {
        std::string pattern = (std::filesystem::temp_directory_path() / "pathscope_XXXXXX").string();
        path_ = ::mkdtemp(pattern.data());
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

}  // namespace pathscope::testing
