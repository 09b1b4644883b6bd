#pragma once
/// Whole files in, whole files out, each error as one sentence with the path in it.
/// Thread safety: yes, for different paths.

#include <filesystem>
#include <string>
#include <string_view>

#include "pathscope/core/result.hpp"

namespace pathscope {

/// Refuses directories, missing and unreadable files.
[[nodiscard]] Result<std::string> read_file(const std::filesystem::path& path);

/// Writes beside the target and renames, so that a reader sees the old file or the new one, never half of
/// one, and a loss of power after the return changes nothing. Makes no folders. Kind of error: bad_input when the
/// place cannot be written to.
[[nodiscard]] Result<void> write_file_atomically(const std::filesystem::path& path, std::string_view bytes);

/// Removes what the functions around this one left beside `path` when their program was killed. Requires: no other program
/// writes `path`; it would have to write it again.
void remove_abandoned_parts(const std::filesystem::path& path);

/// The one question that permissions, full disks and read-only mounts all answer: can a file be made there? Leaves a
/// file that is there already as it is.
[[nodiscard]] Result<void> check_place(const std::filesystem::path& path);

}  // namespace pathscope
