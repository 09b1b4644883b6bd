#pragma once
/// Where the files of a scene come from: a folder on this machine, or files that a client sent.
///
/// A scene is one JSON or OBJ file and what it names: OBJ, MTL, images. All of them are read through a
/// FileSource, by the name that stands in the referring file ("scene-relative": see scene_name()). DiskFiles
/// finds such names in a folder, however they were spelt, and writes down each file it handed out with its
/// content hash. That manifest is what travels to a render server; there ManifestFiles answers the same names
/// with the same bytes, so a scene loads into the same bits on every machine:
///
///     DiskFiles disk(folder);                      // client
///     load_scene_parts(file, disk, options);
///     send(disk.manifest());
///     ManifestFiles sent(manifest, path_in_cache); // server
///     load_scene_parts(file, sent, options);       // the same SceneParts
///
/// Security: a name that came over the network is a key and nothing else; it never becomes a path.
/// Thread safety: one thread per FileSource.   Test: tests/scene/test_file_source.cpp

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "pathscope/core/hash.hpp"
#include "pathscope/core/result.hpp"

namespace pathscope {

class FileSource {
  public:
    virtual ~FileSource() = default;

    /// The bytes of a file; nothing where there is no such file; an error where there is one that cannot be
    /// read.
    [[nodiscard]] virtual Result<std::optional<std::string>> find(std::string_view name) = 0;

    /// How errors name a file: as a path that a person can open, where there is one.
    [[nodiscard]] virtual std::string display_name(std::string_view name) const { return std::string(name); }

    /// Of the bytes that find() gave for this name, where the source has it at hand: hashing takes time.
    [[nodiscard]] virtual std::optional<Digest> known_hash(std::string_view) const { return std::nullopt; }

    /// As find(), but a missing file is an error.
    [[nodiscard]] Result<std::string> read(std::string_view name);
};

/// A name as it stands in the file `referrer`, made relative to the scene's folder: the folder of the
/// referrer is put before it, '\' becomes '/', "a/./b" becomes "a/b", spaces around it go. An absolute name
/// stays absolute.
[[nodiscard]] std::string scene_name(std::string_view referrer, std::string_view name);

struct ManifestEntry {
    std::string name;
    std::uint64_t size = 0;
    Digest hash{};

    friend bool operator==(const ManifestEntry&, const ManifestEntry&) = default;
};

/// What a load asked for and what it got; sorted by name.
struct Manifest {
    std::vector<ManifestEntry> files;
    std::vector<std::string> missing;  ///< Looked for and not found: a remote load must miss them too.

    friend bool operator==(const Manifest&, const Manifest&) = default;
};

/// Files of a folder. A name is looked up part by part; where a part is missing in this spelling, one that
/// differs only in letter case is taken (scenes made elsewhere say SP_LUK.JPG and mean sp_luk.JPG). A name
/// that is absolute on its author's machine (C:\textures\a.png) and missing on this one is looked for, by its
/// last part, in the folder itself.
class DiskFiles final : public FileSource {
  public:
    explicit DiskFiles(std::filesystem::path root);

    [[nodiscard]] Result<std::optional<std::string>> find(std::string_view name) override;
    [[nodiscard]] std::string display_name(std::string_view name) const override;
    [[nodiscard]] std::optional<Digest> known_hash(std::string_view name) const override;

    [[nodiscard]] Manifest manifest() const;

    /// The file that a name stood for. Nothing if it was not handed out, so that a client sends only what it
    /// listed.
    [[nodiscard]] std::optional<std::filesystem::path> path_of(std::string_view name) const;

  private:
    struct Found {
        std::filesystem::path path;
        std::uint64_t size = 0;
        Digest hash{};
    };

    std::filesystem::path root_;
    std::map<std::string, Found, std::less<>> found_;
    std::set<std::string, std::less<>> missing_;
};

/// Exactly the files of a manifest, each verified against its size and hash when it is read.
/// A name that the manifest does not mention is an error, not a miss: the two loads would differ.
class ManifestFiles final : public FileSource {
  public:
    /// Where the bytes of a content hash lie on this machine.
    using PathOfHash = std::function<std::filesystem::path(const Digest&)>;

    ManifestFiles(const Manifest& manifest, PathOfHash path_of_hash);

    [[nodiscard]] Result<std::optional<std::string>> find(std::string_view name) override;
    [[nodiscard]] std::optional<Digest> known_hash(std::string_view name) const override;

  private:
    std::map<std::string, ManifestEntry, std::less<>> files_;
    std::set<std::string, std::less<>> missing_;
    PathOfHash path_of_hash_;
};

}  // namespace pathscope
