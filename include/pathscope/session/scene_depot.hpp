#pragma once
/// The files of the client's scene, for servers that ask: the client's side of MANIFEST and PIECE.
///
/// Only what the manifest lists is ever read, by content hash; no name from the network is looked at. A file that changed
/// since it was loaded is noticed by the server, which checks the hash of what it gets.
/// Thread safety: one thread at a time.   Test: tests/session/test_scene_fetch.cpp

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "pathscope/core/hash.hpp"
#include "pathscope/protocol/message.hpp"
#include "pathscope/scene/file_source.hpp"
#include "pathscope/session/scene_cache.hpp"

namespace pathscope {

class SceneDepot {
  public:
    SceneDepot() : SceneDepot(Manifest{}, {}) {}
    explicit SceneDepot(const DiskFiles& files);
    /// Of files that lie in a cache.
    SceneDepot(const Manifest& manifest, const SceneCache& cache);

    /// The render state names the files by this.
    [[nodiscard]] const Digest& manifest_hash() const { return manifest_hash_; }

    /// Nothing if what is asked for is not in the manifest or cannot be read any more.
    [[nodiscard]] std::optional<message::Manifest> answer(const message::ManifestRequest& request) const;
    [[nodiscard]] std::optional<message::Piece> answer(const message::PieceRequest& request) const;

  private:
    struct File {
        std::filesystem::path path;
        std::uint64_t size = 0;
    };
    SceneDepot(const Manifest& manifest, std::map<Digest, File> files);

    std::string packed_manifest_;
    Digest manifest_hash_{};
    std::map<Digest, File> files_;
};

}  // namespace pathscope
