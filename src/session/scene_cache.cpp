#include "pathscope/session/scene_cache.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <system_error>

#include "pathscope/core/files.hpp"

namespace pathscope {

std::filesystem::path SceneCache::default_folder() {
    if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache == '/')
        return std::filesystem::path(cache) / "pathscope";
    if (const char* home = std::getenv("HOME"); home && *home == '/')
        return std::filesystem::path(home) / ".cache" / "pathscope";
    std::error_code ignored;
    return std::filesystem::temp_directory_path(ignored) / fmt::format("pathscope-{}", ::getuid());
}

std::filesystem::path SceneCache::path_of(const Digest& hash) const {
    const std::string name = to_hex(hash);
    return folder_ / name.substr(0, 2) / name;
}

bool SceneCache::holds(const Digest& hash, std::uint64_t size) const {
    std::error_code error;
    const std::uintmax_t found = std::filesystem::file_size(path_of(hash), error);
    return !error && found == size;
}

Result<void> SceneCache::store(const Digest& hash, std::string_view bytes) const {
    if (hash_text(bytes) != hash)
        return failed(fmt::format("A scene file arrived damaged: its hash is not {}.", to_hex(hash)));
    const std::filesystem::path path = path_of(hash);
    std::error_code error;
    std::filesystem::create_directories(path.parent_path(), error);
    if (error)
        return failed(fmt::format("Cannot make the cache folder {}: {}.", path.parent_path().string(),
                                  error.message()));
    return write_file_atomically(path, bytes);
}

void SceneCache::forget(const Digest& hash) const {
    std::error_code ignored;
    std::filesystem::remove(path_of(hash), ignored);
}

}  // namespace pathscope
