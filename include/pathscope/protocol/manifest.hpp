#pragma once
/// The list of a scene's files, as the payload of MANIFEST: docs/protocol.md, section 5.2.
///
/// The scene's hash is the hash of these bytes, so a list that was altered shows itself. Names come from a peer and become
/// paths, so only plain relative ones pass: no "..", nothing absolute, no drive, no backslash.
/// Thread safety: yes.   Test: tests/protocol/test_manifest.cpp

#include <string>
#include <string_view>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/protocol/message.hpp"

namespace pathscope {

inline constexpr std::size_t k_max_manifest_files = 65536;

[[nodiscard]] bool is_plain_relative_path(std::string_view name);

/// Sorts by name. Error: a name that cannot travel, or one that is listed twice, or more files than may be.
[[nodiscard]] Result<std::string> pack_manifest(std::vector<ManifestEntry> files);

[[nodiscard]] Result<std::vector<ManifestEntry>> unpack_manifest(std::string_view bytes);

}  // namespace pathscope
