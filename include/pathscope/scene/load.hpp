#pragma once
/// From names to data: the mesh, materials and textures of a scene.
///
/// open_scene() is for the machine that has the files, load_scene_parts() for any. What is wrong with a file
/// is an error with file and line; what is odd but can be lived with is said once (core/log.hpp): a missing
/// texture, triangles without area, properties that are not used.
///
/// The result is a pure function of the files' bytes, the scene file and the options. A mesh cache
/// (mesh_cache.hpp) changes how long it takes and nothing else.
/// Thread safety: yes, for different FileSources.   Test: tests/scene/test_load.cpp

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "pathscope/core/result.hpp"
#include "pathscope/geometry/mesh.hpp"
#include "pathscope/image/image.hpp"
#include "pathscope/scene/file_source.hpp"
#include "pathscope/scene/material.hpp"
#include "pathscope/scene/mesh_cache.hpp"
#include "pathscope/scene/scene_file.hpp"
#include "pathscope/scene/texture.hpp"

namespace pathscope {

struct SceneOptions {
    MaterialModel material = MaterialModel::frostbite;
    bool smoothing = true;  ///< Where an OBJ gives no normals: smooth within smoothing groups, or flat.
    TexelSpace texel_space = TexelSpace::linear;

    friend bool operator==(const SceneOptions&, const SceneOptions&) = default;
};

/// What the files of a scene hold. Lights of the scene file that are not in a mesh are not in here, save for
/// the image of an envmap.
struct SceneParts {
    Mesh mesh;  ///< All OBJ files, one after the other.
    std::vector<Material> materials;
    std::vector<Texture> textures;
    std::optional<Image> envmap;           ///< Of the EnvmapSpec, decoded, neither scaled nor turned.
    std::size_t degenerate_triangles = 0;  ///< Left out, because they have no area.
};

/// More than this is refused in a sentence: a scene file may come from a stranger.
inline constexpr std::size_t k_max_texture_bytes = std::size_t{4} << 30;

[[nodiscard]] Result<SceneParts> load_scene_parts(const SceneFile& scene, FileSource& files,
                                                  const SceneOptions& options,
                                                  const std::optional<MeshCache>& cache = std::nullopt);

struct OpenedScene {
    SceneFile file;  ///< Complete: with at least one camera and one light.
    SceneParts parts;
    std::unique_ptr<DiskFiles> files;  ///< Its manifest() lists what a server needs.
};

/// Opens a scene file (.json) or a bare .obj. What the file does not say is chosen so that something is seen,
/// and said in a note: a camera that sees the whole mesh; a sky where nothing emits. A bare .obj that is
/// named by a scene.json beside it (as its obj or one of its variants) takes camera and lights from there.
[[nodiscard]] Result<OpenedScene> open_scene(const std::filesystem::path& path, const SceneOptions& options,
                                             const std::optional<MeshCache>& cache = std::nullopt);

}  // namespace pathscope
