#include "pathscope/scene/mesh_cache.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "model_bytes.hpp"
#include "pathscope/core/files.hpp"
#include "pathscope/core/log.hpp"

namespace pathscope {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view k_extension = ".mesh";

std::string_view text_of(const Digest& digest) {
    return {reinterpret_cast<const char*>(digest.data()), digest.size()};
}

Digest seal_of(const Digest& key, std::string_view payload) {
    Hasher hasher;
    hasher.add(text_of(key));
    hasher.add(payload);
    return hasher.finish();
}

/// Our own, or the part of one that a program began to write and did not live to rename. Nothing else in the folder is
/// ever counted or removed: it may be anybody's.
bool is_cache_file(const fs::path& path) {
    const std::string name = path.filename().string();
    const std::size_t digits = 2 * Digest{}.size();
    return name.size() > digits && digest_from_hex(std::string_view(name).substr(0, digits)) &&
           std::string_view(name).substr(digits).starts_with(k_extension);
}

struct CacheFile {
    fs::path path;
    std::uint64_t bytes = 0;
    fs::file_time_type used;
};

std::vector<CacheFile> files_in(const fs::path& folder) {
    std::vector<CacheFile> files;
    std::error_code end;
    for (fs::directory_iterator entry(folder, end), last; !end && entry != last; entry.increment(end)) {
        std::error_code gone;
        CacheFile file{entry->path(), entry->file_size(gone), {}};
        if (!gone) file.used = entry->last_write_time(gone);
        if (!gone && is_cache_file(file.path)) files.push_back(std::move(file));
    }
    return files;
}

}  // namespace

Digest MeshCache::key_of(const Digest& obj_hash, bool smoothing) {
    return hash_text(fmt::format("pathscope mesh {}, {} endian, smoothing {}, obj {}", k_mesh_cache_version,
                                 std::endian::native == std::endian::little ? "little" : "big",
                                 smoothing ? "on" : "off", to_hex(obj_hash)));
}

fs::path MeshCache::path_of(const Digest& key) const {
    return folder_ / (to_hex(key) + std::string(k_extension));
}

std::optional<ObjModel> MeshCache::find(const Digest& key) const {
    const fs::path path = path_of(key);
    std::error_code ignored;
    if (!fs::exists(path, ignored)) return std::nullopt;
    const Result<std::string> file = read_file(path);
    std::optional<ObjModel> model;
    if (file && file->size() >= key.size()) {
        const std::string_view seal = std::string_view(*file).substr(0, key.size());
        const std::string_view payload = std::string_view(*file).substr(key.size());
        if (seal == text_of(seal_of(key, payload))) model = model_from_bytes(payload);
    }
    if (model)
        fs::last_write_time(path, fs::file_time_type::clock::now(), ignored);  // For remove_oldest().
    else
        log_note(fmt::format("{} is damaged or unreadable; the OBJ is read instead and the file replaced.",
                             path.string()));
    return model;
}

void MeshCache::store(const Digest& key, const ObjModel& model) const {
    const std::string payload = model_bytes(model);
    if (payload.size() + key.size() > limits_.most_bytes) return;
    std::error_code error;
    fs::create_directories(folder_, error);
    std::string file(text_of(seal_of(key, payload)));
    file += payload;
    const Result<void> written = write_file_atomically(path_of(key), file);
    if (!written)
        return log_note(fmt::format("{} The mesh is not cached; loading goes on.", written.error().message));
    remove_oldest();
}

void MeshCache::remove_oldest() const {
    std::vector<CacheFile> files = files_in(folder_);
    std::sort(files.begin(), files.end(),
              [](const CacheFile& a, const CacheFile& b) { return a.used > b.used; });
    std::uint64_t bytes = 0;
    for (const CacheFile& file : files) {
        bytes += file.bytes;
        std::error_code ignored;
        if (bytes > limits_.most_bytes) fs::remove(file.path, ignored);
    }
}

}  // namespace pathscope
