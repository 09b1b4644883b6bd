#include "ray_sets.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "pathscope/core/parallel_for.hpp"
#include "pathscope/math/frame.hpp"
#include "pathscope/math/random.hpp"
#include "pathscope/sampling/warp.hpp"
#include "pathscope/scene/light_sampling.hpp"

namespace pathscope::bench {
namespace {

constexpr float k_offset = 1e-4f;  ///< Of the scene's diagonal.
constexpr std::uint32_t k_passes = 16;

struct Pixel {
    int x, y;
};

/// Pixel number i of a square image, block by block, tile by tile. Requires: side is a multiple of 16.
Pixel pixel_in_block_order(int i, int side) {
    const int block = i / 256, tile = i % 256 / 16, in_tile = i % 16;
    const int blocks = side / 16;
    return {block % blocks * 16 + tile % 4 * 4 + in_tile % 4,
            block / blocks * 16 + tile / 4 * 4 + in_tile / 4};
}

/// A point in the air just off a surface, on the side that the ray came from.
struct Vertex {
    Vec3 position, normal;
};

/// The rays that one path through a pixel gives to the sets; nothing from where the path has left the scene.
struct PathRays {
    Ray primary;
    std::optional<Ray> diffuse, incoherent, shadow, shadow3;
};

class PathMaker {
  public:
    PathMaker(const Scene& scene, const CameraFrame& camera)
        : scene_(scene), camera_(camera), offset_(k_offset * 2 * scene_radius(scene)) {}

    [[nodiscard]] PathRays path(Pixel pixel, std::uint32_t seed) const {
        HashRng rng(hash_combine(seed, std::uint32_t(pixel.y * camera_.width + pixel.x)));
        PathRays rays;
        rays.primary = camera_ray(camera_, pixel.x, pixel.y, draw(rng));
        const std::optional<Vertex> first = follow(rays.primary);
        if (!first) return rays;
        rays.diffuse = bounce(*first, rng);
        rays.shadow = towards_light(*first, rng);
        const std::optional<Vertex> second = follow(*rays.diffuse);
        if (!second) return rays;
        const std::optional<Vertex> third = follow(bounce(*second, rng));
        if (!third) return rays;
        rays.incoherent = bounce(*third, rng);
        rays.shadow3 = towards_light(*third, rng);
        return rays;
    }

  private:
    static Vec2 draw(HashRng& rng) {
        const float x = rng.next_float(), y = rng.next_float();
        return {x, y};
    }

    [[nodiscard]] std::optional<Vertex> follow(const Ray& ray) const {
        const std::optional<Hit> hit = closest_hit(scene_.tree, ray);
        if (!hit) return std::nullopt;
        const SurfacePoint point = surface_point(scene_.mesh, *hit);
        const bool front = dot(point.geometric_normal, ray.direction) < 0;
        const Vec3 normal = front ? point.geometric_normal : -point.geometric_normal;
        return Vertex{point.position + normal * offset_, normal};
    }

    static Ray bounce(const Vertex& vertex, HashRng& rng) {
        const Vec3 local = sample_cosine_hemisphere(draw(rng));
        return {vertex.position, normalize(Frame::around(vertex.normal).to_world(local))};
    }

    /// Nothing if the light drawn is behind the surface, or turns its back on it.
    [[nodiscard]] std::optional<Ray> towards_light(const Vertex& vertex, HashRng& rng) const {
        const float u_pick = rng.next_float();
        const std::optional<LightSample> light =
            sample_light(scene_, LightSampling::power, {vertex.position, vertex.normal}, u_pick, draw(rng));
        if (!light || dot(light->direction, vertex.normal) <= 0) return std::nullopt;
        const float reach = light->distance - offset_;  // Infinite for a light at infinity.
        if (reach <= 0) return std::nullopt;
        return Ray{vertex.position, light->direction, 0, reach};
    }

    const Scene& scene_;
    const CameraFrame& camera_;
    float offset_;
};

void append(RaySet& set, const std::optional<Ray>& ray, std::size_t count) {
    if (ray && set.rays.size() < count) set.rays.push_back(*ray);
}

}  // namespace

std::vector<RaySet> make_ray_sets(const Scene& scene, const Camera& camera, std::size_t count) {
    const int side = int(std::sqrt(double(count))) / 16 * 16;
    const int pixels = side * side;
    const CameraFrame frame = make_camera(camera, side, side);
    const PathMaker maker(scene, frame);

    RaySet primary{"primary", RayQuery::closest, true, {}}, diffuse{"diffuse", RayQuery::closest, false, {}},
        incoherent{"incoherent", RayQuery::closest, false, {}}, shadow{"shadow", RayQuery::any, true, {}},
        shadow3{"shadow3", RayQuery::any, false, {}};
    const std::size_t wanted = std::size_t(pixels);
    std::vector<PathRays> paths(wanted);
    for (std::uint32_t pass = 0; pass < k_passes; ++pass) {
        parallel_for(
            pixels, 0,
            [&](int i) { paths[std::size_t(i)] = maker.path(pixel_in_block_order(i, side), pass); }, 1024);
        for (const PathRays& path : paths) {
            append(primary, path.primary, wanted);
            append(diffuse, path.diffuse, wanted);
            append(incoherent, path.incoherent, wanted);
            append(shadow, path.shadow, wanted);
            append(shadow3, path.shadow3, wanted);
        }
        const std::size_t shortest = std::min(std::min(diffuse.rays.size(), incoherent.rays.size()),
                                              std::min(shadow.rays.size(), shadow3.rays.size()));
        if (shortest == wanted) break;
    }
    return {std::move(primary), std::move(diffuse), std::move(incoherent), std::move(shadow),
            std::move(shadow3)};
}

}  // namespace pathscope::bench
