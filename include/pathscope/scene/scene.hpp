#pragma once
/// The scene as the renderer asks for it: what a ray meets, whether two points see each other, what shines.
///
/// A Scene is complete and never changes: mesh (with the quads of the scene file), analytic spheres,
/// materials with their textures, the tree over the triangles and the table of lights. A new state of the
/// scene is a new Scene.
///
/// Cut-outs (map_d below 0.5) are holes for all rays, those of shadows too. Partial opacity is not: it
/// belongs to the BSDF. Of surfaces that coincide, the triangle with the lowest number counts, and a triangle
/// before a sphere.
/// Emission. Materials say how much (ke times map_ke) and from which sides; the front is the side of the
/// geometric normal (geometry/hit.hpp). Quads emit from the front only, where the front is the side of edge_u
/// x edge_v, and spheres outwards; both reflect nothing.
/// Units: scene units, radiance. Thread safety: all queries are pure, a Scene is read by any number of threads.
/// Test: tests/scene/test_scene.cpp

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "pathscope/bvh/tree.hpp"
#include "pathscope/core/huge_pages.hpp"
#include "pathscope/core/result.hpp"
#include "pathscope/geometry/hit.hpp"
#include "pathscope/geometry/mesh.hpp"
#include "pathscope/geometry/sphere.hpp"
#include "pathscope/math/box.hpp"
#include "pathscope/scene/lights.hpp"
#include "pathscope/scene/load.hpp"
#include "pathscope/scene/material.hpp"
#include "pathscope/scene/scene_file.hpp"
#include "pathscope/scene/texture.hpp"

namespace pathscope {

/// A sphere as it is, not tessellated. Rays test each of them, so they should be few.
struct Sphere {
    Vec3 centre;
    float radius = 1;
    std::uint32_t material = 0;
};

struct Scene {
    Mesh mesh;
    HugePageVector<TriangleRecord> records;  ///< Of each triangle of the mesh.
    std::vector<std::uint64_t>
        cutouts;  ///< A bit for each triangle whose material has holes; empty if none has.
    std::vector<Sphere> spheres;
    std::vector<Material> materials;
    std::vector<Texture> textures;
    Tree tree;
    LightTable lights;
    Box bounds;  ///< Of mesh and spheres.
    /// What quantum_for() asks (image/exact_sum.hpp): a surface well lit, and the brightest emitter.
    float typical_radiance = 0, brightest_radiance = 0;
};

/// How to build; no part of what the scene looks like.
struct SceneBuild {
    int threads = 0;  ///< 0 = all cores; the result does not depend on it.
    TreeKind tree = TreeKind::wide;
};

/// Adds quads and spheres to the parts, decides which materials emit, builds tree and light table. Materials emit if the
/// file lists emissive_mtl, or no light at all (a bare .obj). A scene without light is black, and said to be, but is no
/// error. Refuses an environment map that is none, and a scene too large or too bright for floats. Requires: lights as
/// parse_scene_file gives them, parts as load_scene_parts does.
[[nodiscard]] Result<Scene> make_scene(const SceneFile& file, SceneParts parts, const SceneBuild& build = {});

inline constexpr std::uint32_t k_no_triangle = 0xffffffffu;

struct SceneHit {
    SurfacePoint point;  ///< On a sphere point.triangle is k_no_triangle, and both normals point outwards.
    float distance = 0;  ///< t along the ray.
    std::uint32_t light = k_no_light;  ///< In Scene::lights, if the surface is an emitter (on either side).
};

/// The first surface that the ray meets. Requires: direction of length one.
[[nodiscard]] std::optional<SceneHit> intersect(const Scene& scene, const Ray& ray);

/// The same, in a place that the caller has: a path's rays write it many times over.
void intersect(const Scene& scene, const Ray& ray, std::optional<SceneHit>& hit);

/// Whether anything lies in [t_min, t_max] of the ray.
[[nodiscard]] bool occluded(const Scene& scene, const Ray& ray);

/// The same, sooner for rays of neighbouring points towards the same lights (bvh/occluder_cache.hpp).
[[nodiscard]] bool occluded(const Scene& scene, const Ray& ray, OccluderCache& occluders);

/// hits[i] = intersect(scene, rays[i]), bit by bit, and faster for rays of neighbouring pixels. Requires: at most
/// k_packet_rays of them, as many places in hits.
void intersect(const Scene& scene, std::span<const Ray> rays, std::span<std::optional<SceneHit>> hits);

/// intersect(), counted: for the traversal-cost buffer.
[[nodiscard]] std::optional<SceneHit> intersect(const Scene& scene, const Ray& ray, TraversalCounts& counts);

/// What the surface sends towards `outgoing` by itself. Zero for all but emitters.
[[nodiscard]] Rgb emitted_radiance(const Scene& scene, const SceneHit& hit, Vec3 outgoing);

/// What arrives from infinity, against `direction`: sky, environment maps and the discs of suns, added up.
[[nodiscard]] Rgb environment_radiance(const Scene& scene, Vec3 direction);

/// Whether any triangle has holes: else rays need not ask.
[[nodiscard]] inline bool has_cutouts(const Scene& scene) { return !scene.cutouts.empty(); }

/// False in the holes of the triangle's cut-out.
[[nodiscard]] bool is_solid(const Scene& scene, std::uint32_t triangle, float u, float v);

/// Half the diagonal of Scene::bounds; 1 if that is 0, so that light from infinity has a disc to fall on.
[[nodiscard]] float scene_radius(const Scene& scene);

}  // namespace pathscope
