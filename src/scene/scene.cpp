#include "pathscope/scene/scene.hpp"

#include <algorithm>
#include <array>

#include "lookup.hpp"

namespace pathscope {
namespace {

/// The nearest sphere before the ray's end.
struct NearestSphere {
    SphereHit hit;
    std::uint32_t index = 0;
};
std::optional<NearestSphere> nearest_sphere(const Scene& scene, Ray ray) {
    std::optional<NearestSphere> nearest;
    for (std::uint32_t i = 0; i < scene.spheres.size(); ++i) {
        const auto hit = intersect_sphere(ray, scene.spheres[i].centre, scene.spheres[i].radius);
        if (!hit || (nearest && hit->t == ray.t_max)) continue;
        ray.t_max = hit->t;
        nearest = NearestSphere{*hit, i};
    }
    return nearest;
}

SceneHit hit_on_sphere(const Scene& scene, const NearestSphere& nearest) {
    SceneHit hit;
    hit.point.position = nearest.hit.position;
    hit.point.position_error = nearest.hit.position_error;
    hit.point.geometric_normal = hit.point.shading_normal = nearest.hit.normal;
    hit.point.triangle = k_no_triangle;
    hit.point.material = scene.spheres[nearest.index].material;
    hit.distance = nearest.hit.t;
    hit.light = scene.lights.of_sphere[nearest.index];
    return hit;
}

void fill_hit_on_mesh(const Scene& scene, const Hit& found, SceneHit& hit) {
    fill_surface_point(scene.mesh, scene.records[found.triangle], found, hit.point);
    hit.distance = found.t;
    // The material is asked first: it is needed anyway, while the table is one more line from memory.
    if (scene.materials[hit.point.material].emits()) hit.light = scene.lights.of_triangle[found.triangle];
}

/// What the ray meets, spheres included, where the hit is the first on the mesh.
void complete_hit(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit,
                  std::optional<SceneHit>& completed) {
    if (!scene.spheres.empty()) {
        Ray rest = ray;
        if (hit) rest.t_max = hit->t;
        const auto sphere = nearest_sphere(scene, rest);
        if (sphere && !(hit && sphere->hit.t == hit->t)) {
            completed = hit_on_sphere(scene, *sphere);
            return;
        }
    }
    if (hit) {
        fill_hit_on_mesh(scene, *hit, completed.emplace());
    } else {
        completed.reset();
    }
}

bool meets_sphere(const Scene& scene, const Ray& ray) {
    return std::ranges::any_of(scene.spheres, [&](const Sphere& sphere) {
        return intersect_sphere(ray, sphere.centre, sphere.radius).has_value();
    });
}

/// The holes of cut-outs, for a traversal. Scenes without any need not ask.
struct Solid {
    const Scene& scene;

    bool operator()(std::uint32_t triangle, float u, float v) const {
        return is_solid(scene, triangle, u, v);
    }
};

}  // namespace

bool is_solid(const Scene& scene, std::uint32_t triangle, float u, float v) {
    const bool has_holes = has_cutouts(scene) && (scene.cutouts[triangle / 64] >> triangle % 64 & 1);
    if (!has_holes) return true;
    const Material& material = scene.materials[scene.records[triangle].material];
    return is_solid_at(scene, material, interpolate_uv(scene.mesh, triangle, u, v));
}

void intersect(const Scene& scene, const Ray& ray, std::optional<SceneHit>& hit) {
    complete_hit(
        scene, ray,
        has_cutouts(scene) ? closest_hit(scene.tree, ray, Solid{scene}) : closest_hit(scene.tree, ray), hit);
}

std::optional<SceneHit> intersect(const Scene& scene, const Ray& ray) {
    std::optional<SceneHit> hit;
    intersect(scene, ray, hit);
    return hit;
}

void intersect(const Scene& scene, std::span<const Ray> rays, std::span<std::optional<SceneHit>> hits) {
    std::array<std::optional<Hit>, k_packet_rays> found;
    const std::span<std::optional<Hit>> closest = std::span(found).first(rays.size());
    has_cutouts(scene) ? closest_hits(scene.tree, rays, closest, Solid{scene})
                       : closest_hits(scene.tree, rays, closest);
    for (std::size_t i = 0; i < rays.size(); ++i) complete_hit(scene, rays[i], closest[i], hits[i]);
}

std::optional<SceneHit> intersect(const Scene& scene, const Ray& ray, TraversalCounts& counts) {
    std::optional<SceneHit> hit;
    complete_hit(scene, ray,
                 has_cutouts(scene) ? closest_hit(scene.tree, ray, Solid{scene}, counts)
                                    : closest_hit(scene.tree, ray, AcceptAll{}, counts),
                 hit);
    return hit;
}

bool occluded(const Scene& scene, const Ray& ray) {
    const bool by_mesh =
        has_cutouts(scene) ? any_hit(scene.tree, ray, Solid{scene}) : any_hit(scene.tree, ray);
    return by_mesh || meets_sphere(scene, ray);
}

bool occluded(const Scene& scene, const Ray& ray, OccluderCache& occluders) {
    const bool by_mesh = has_cutouts(scene) ? any_hit(scene.tree, ray, Solid{scene}, occluders)
                                            : any_hit(scene.tree, ray, AcceptAll{}, occluders);
    return by_mesh || meets_sphere(scene, ray);
}

Rgb emitted_radiance(const Scene& scene, const SceneHit& hit, Vec3 outgoing) {
    return emission_at(scene, hit.point, outgoing);
}

Rgb environment_radiance(const Scene& scene, Vec3 direction) {
    Rgb sum;
    for (const std::uint32_t index : scene.lights.infinite) {
        const Light& light = scene.lights.lights[index];
        if (const auto* sky = std::get_if<SkyLight>(&light)) sum += sky->radiance;
        if (const auto* map = std::get_if<EnvironmentLight>(&light))
            sum += environment_map_radiance(scene.lights.environments[map->map], direction);
        if (const auto* sun = std::get_if<SunLight>(&light))
            if (sun_covers(*sun, direction)) sum += sun->radiance;
    }
    return sum;
}

float scene_radius(const Scene& scene) {
    const float radius = length(scene.bounds.extent()) / 2;
    return radius > 0 ? radius : 1;
}

}  // namespace pathscope
