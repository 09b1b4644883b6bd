#include "pathscope/render/guides.hpp"

#include "pathscope/core/parallel_for.hpp"
#include "pathscope/integrator/vertex.hpp"

namespace pathscope {
namespace {

struct Guide {
    Rgb albedo;
    Vec3 normal;
    float depth = 0;
};

/// What one camera ray meets first; nothing where it meets nothing.
std::optional<Guide> first_surface(const Scene& scene, const Ray& ray) {
    const std::optional<SceneHit> hit = intersect(scene, ray);
    if (!hit) return std::nullopt;
    const Vec3 outgoing = -ray.direction;
    const Vec3 normal = hit->point.shading_normal;
    return Guide{surface_albedo(scene, *hit, outgoing), dot(normal, outgoing) < 0 ? -normal : normal,
                 hit->distance};
}

Guide mean_guide(const Scene& scene, const CameraFrame& camera, const RenderSettings& settings, int x,
                 int y) {
    Guide sum;
    int hits = 0;
    for (std::uint32_t sample = 0; sample < k_guide_samples; ++sample) {
        const PixelSampler sampler(settings.transport.sampler, settings.seed, x, y, sample);
        const auto guide = first_surface(scene, camera_ray(camera, x, y, sampler.get_2d(k_pixel_dimension)));
        if (!guide) continue;
        ++hits;
        sum.albedo += guide->albedo;
        sum.normal += guide->normal;
        sum.depth += guide->depth;
    }
    if (hits == 0) return {};
    const float length_of_sum = length(sum.normal);
    return {sum.albedo / float(k_guide_samples), length_of_sum > 0 ? sum.normal / length_of_sum : Vec3{},
            sum.depth / float(hits)};
}

}  // namespace

Guides render_guides(const Scene& scene, const Camera& camera, const RenderSettings& settings, PixelRect rect,
                     int threads) {
    const CameraFrame camera_frame = make_camera(camera, settings.width, settings.height);
    Guides guides{Image(rect.width, rect.height), Image(rect.width, rect.height),
                  Plane(rect.width, rect.height)};
    parallel_for(rect.height, threads, [&](int y) {
        for (int x = 0; x < rect.width; ++x) {
            const Guide guide = mean_guide(scene, camera_frame, settings, rect.x + x, rect.y + y);
            guides.albedo.at(x, y) = guide.albedo;
            guides.normal.at(x, y) = guide.normal;
            guides.depth.at(x, y) = guide.depth;
        }
    });
    return guides;
}

}  // namespace pathscope
