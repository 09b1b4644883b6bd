#pragma once
/// Parsed OBJ files on disk, so that a mesh that was read once loads as fast as its bytes can be hashed.
///
///     key  = BLAKE2b(version of the format, options that change the outcome, BLAKE2b of the OBJ's bytes)
///     file = seal payload       seal = BLAKE2b(key payload)       at <folder>/<key in hex>.mesh
///
/// The seal covers the key, so one comparison refuses what is damaged, cut off, renamed, or of another version. Nothing
/// is trusted beyond that: the mesh is validated again as if it had just been parsed. A file that is refused is
/// replaced after the OBJ was parsed. So the cache decides how long loading takes, and never what is loaded.
///
/// Files appear whole or not at all, so several programs may share a folder; it is safe to delete at any moment. After
/// a new file is written, those that were not used for the longest time go, until the rest is within the limit.
/// The payload has the byte order of its machine, which is part of the key.
///
/// Thread safety: yes.   Tests: tests/scene/test_mesh_cache.cpp, tests/system/test_mesh_cache.py

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

#include "pathscope/core/hash.hpp"
#include "pathscope/scene/obj.hpp"

namespace pathscope {

/// Raise it whenever parse_obj makes something else of the same text, or the payload is laid out in another way. The
/// test holds the seal of a known model: it fails when this was forgotten.
inline constexpr int k_mesh_cache_version = 1;

struct MeshCacheLimits {
    std::uint64_t most_bytes = std::uint64_t{2} << 30;  ///< Of all files together.
    std::size_t least_obj_bytes =
        std::size_t{256} * 1024;  ///< A smaller OBJ is parsed before a file is open.
};

class MeshCache {
  public:
    explicit MeshCache(std::filesystem::path folder, MeshCacheLimits limits = {})
        : folder_(std::move(folder)), limits_(limits) {}

    [[nodiscard]] static Digest key_of(const Digest& obj_hash, bool smoothing);
    [[nodiscard]] std::filesystem::path path_of(const Digest& key) const;
    [[nodiscard]] const MeshCacheLimits& limits() const { return limits_; }

    /// Nothing where there is no such file. One that is refused is mentioned, and nothing too.
    [[nodiscard]] std::optional<ObjModel> find(const Digest& key) const;

    /// A folder that cannot be written to is mentioned; loading goes on.
    void store(const Digest& key, const ObjModel& model) const;

  private:
    void remove_oldest() const;

    std::filesystem::path folder_;
    MeshCacheLimits limits_;
};

}  // namespace pathscope
