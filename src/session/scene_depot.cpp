#include "pathscope/session/scene_depot.hpp"

#include <algorithm>
#include <fstream>

#include "pathscope/session/render_state.hpp"

namespace pathscope {

SceneDepot::SceneDepot(const Manifest& manifest, std::map<Digest, File> files)
    : packed_manifest_(pack_manifest(manifest)),
      manifest_hash_(hash_text(packed_manifest_)),
      files_(std::move(files)) {}

SceneDepot::SceneDepot(const DiskFiles& files) : SceneDepot(files.manifest(), {}) {
    for (const ManifestEntry& entry : files.manifest().files)
        if (const auto path = files.path_of(entry.name)) files_[entry.hash] = {*path, entry.size};
}

SceneDepot::SceneDepot(const Manifest& manifest, const SceneCache& cache)
    : SceneDepot(manifest, std::map<Digest, File>()) {
    for (const ManifestEntry& entry : manifest.files)
        files_[entry.hash] = {cache.path_of(entry.hash), entry.size};
}

std::optional<message::Manifest> SceneDepot::answer(const message::ManifestRequest& request) const {
    if (request.scene != manifest_hash_) return std::nullopt;
    return message::Manifest{manifest_hash_, packed_manifest_};
}

std::optional<message::Piece> SceneDepot::answer(const message::PieceRequest& request) const {
    const auto found = files_.find(request.hash);
    if (found == files_.end() || request.offset >= found->second.size) return std::nullopt;
    const std::uint64_t left = found->second.size - request.offset;
    std::string bytes(std::size_t(std::min<std::uint64_t>(request.length, left)), '\0');
    std::ifstream file(found->second.path, std::ios::binary);
    file.seekg(std::streamoff(request.offset));
    if (!file.read(bytes.data(), std::streamsize(bytes.size()))) return std::nullopt;
    return message::Piece{request.hash, request.offset, found->second.size, std::move(bytes)};
}

}  // namespace pathscope
