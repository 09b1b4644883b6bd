#pragma once
/// Scene files on a server's disk, by what they contain.
///
///     <folder>/ab/ab12...ef        the file whose BLAKE2b is ab12...ef
///
/// Why: a file is sent once, whatever it was called and whichever scene it belongs to. A name from the network never
/// becomes a path: only hashes do. Files appear whole or not at all, so several servers may share a folder; it is
/// safe to delete at any moment.
/// Thread safety: yes, for different hashes.   Test: tests/session/test_scene_cache.cpp

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "pathscope/core/hash.hpp"
#include "pathscope/core/result.hpp"

namespace pathscope {

class SceneCache {
  public:
    explicit SceneCache(std::filesystem::path folder) : folder_(std::move(folder)) {}

    /// $XDG_CACHE_HOME/pathscope, or ~/.cache/pathscope, or a folder of this user in the temporary folder.
    [[nodiscard]] static std::filesystem::path default_folder();

    [[nodiscard]] std::filesystem::path path_of(const Digest& hash) const;

    /// Whether a file of that size lies there. Its content is verified when it is read (ManifestFiles).
    [[nodiscard]] bool holds(const Digest& hash, std::uint64_t size) const;

    /// Refuses bytes whose hash is another.
    [[nodiscard]] Result<void> store(const Digest& hash, std::string_view bytes) const;

    void forget(const Digest& hash) const;

  private:
    std::filesystem::path folder_;
};

}  // namespace pathscope
