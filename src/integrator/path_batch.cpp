#include "pathscope/integrator/path_batch.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "pathscope/core/check.hpp"

namespace pathscope {

PathBatch::PathBatch(const Scene& scene, const CameraFrame& camera, const TransportSettings& settings,
                     LightParts parts)
    : scene_(scene),
      camera_(camera),
      settings_(settings),
      parts_(parts),
      light_count_(light_sample_count(scene, settings)) {
    paths_.reserve(k_capacity);
}

void PathBatch::add(int x, int y, const PixelSampler& sampler) {
    if (std::exchange(traced_, false)) paths_.clear();
    CHECK(!full());
    paths_.emplace_back(x, y, sampler);
}

/// Takes a step of each path, by its number and its place among those alive; those for which step() is false are alive no more.
template <class Step>
void PathBatch::keep_alive(Step step) {
    std::size_t kept = 0;
    for (std::size_t place = 0; place < alive_.size(); ++place)
        if (const std::uint32_t path = alive_[place]; step(path, place)) alive_[kept++] = path;
    alive_.resize(kept);
}

/// Of the paths that are alive.
template <std::size_t dimensions>
void PathBatch::draw_numbers(std::uint32_t first_dimension, PairRows<dimensions>& numbers) {
    samplers_.clear();
    for (const std::uint32_t path : alive_) samplers_.add(paths_[path].sampler);
    get_2d(samplers_, first_dimension, numbers);
}

void PathBatch::trace_camera_rays() {
    draw_numbers(k_pixel_dimension, places_);
    rays_.resize(alive_.size());
    hits_.resize(alive_.size());
    for (std::size_t i = 0; i < rays_.size(); ++i)
        rays_[i] = camera_ray(camera_, paths_[i].x, paths_[i].y, {places_.x[0][i], places_.y[0][i]});
    for (std::size_t begin = 0; begin < rays_.size(); begin += k_packet_rays) {
        const std::size_t count = std::min(k_packet_rays, rays_.size() - begin);
        intersect(scene_, std::span(rays_).subspan(begin, count), std::span(hits_).subspan(begin, count));
    }
}

std::span<const PartsRadiance> PathBatch::trace(std::uint64_t& rays) {
    const std::size_t samples = size();
    CHECK(samples > 0);
    radiance_.assign(samples, {});
    alive_.resize(samples);
    std::iota(alive_.begin(), alive_.end(), 0u);
    trace_camera_rays();
    rays += samples;
    for (int bounce = 0;; ++bounce) {
        keep_alive([&](std::uint32_t path, std::size_t) { return arrive(path, bounce); });
        if (alive_.empty()) break;
        requests_.clear();
        lights_.clear();
        draw_numbers(BounceSample::first_dimension(bounce), numbers_);
        keep_alive([&](std::uint32_t path, std::size_t place) {
            return leave(path, bounce, {numbers_, place});
        });
        collect_light(bounce);
        for (const std::uint32_t path : alive_) intersect(scene_, rays_[path], hits_[path]);
        rays += lights_.size() + alive_.size();
    }
    traced_ = true;
    return radiance_;
}

/// Light that the ray runs into. Whether the path has a vertex there.
bool PathBatch::arrive(std::uint32_t number, int bounce) {
    const Path& path = paths_[number];
    const std::optional<SceneHit>& hit = hits_[number];
    const bool sees_direct =
        path.diffuse_vertices == 0 || (path.diffuse_vertices == 1 && path.origin.diffuse);
    if (sees_direct ? parts_.direct : parts_.indirect) {
        const Rgb emitted = emission_towards(scene_, settings_, path.origin, rays_[number], hit);
        if (!is_zero(emitted)) {
            if (sees_direct)
                radiance_[number].direct += path.direct_throughput * emitted;
            else
                radiance_[number].indirect += path.throughput * emitted;
        }
    }
    return path.goes_on && hit && !(settings_.max_bounces > 0 && bounce == settings_.max_bounces);
}

/// Asks for the light at the vertex, and makes the next ray. Whether there is one.
bool PathBatch::leave(std::uint32_t number, int bounce, const BounceSample& random) {
    Path& path = paths_[number];
    const Vertex vertex(scene_, *hits_[number], -rays_[number].direction);
    if (!vertex.specular) ++path.diffuse_vertices;
    const bool is_first_diffuse = !vertex.specular && path.diffuse_vertices == 1;
    if (!vertex.specular && (is_first_diffuse ? parts_.direct : parts_.indirect))
        ask_lights(number, is_first_diffuse, vertex, random);

    const std::optional<NextDirection> next = sample_next_direction(settings_, vertex, random);
    if (!next) return false;
    const bool direct_lives = parts_.direct && (path.diffuse_vertices == 0 ||
                                                (is_first_diffuse && sees_emitters(settings_, next->delta)));
    if (!direct_lives && !parts_.indirect) return false;
    path.throughput *= next->weight;
    if (is_zero(path.throughput)) return false;
    if (!is_finite(path.throughput)) {  // Not a radiance: the caller drops and counts the sample.
        if (parts_.indirect) radiance_[number].indirect = path.throughput;
        if (direct_lives) radiance_[number].direct = path.throughput;
        return false;
    }
    path.direct_throughput = path.throughput;
    path.strength.now = max_component(path.throughput);
    if (is_first_diffuse) path.strength.first = path.strength.now;
    if (path.diffuse_vertices > 0 && !parts_.indirect) {
        path.goes_on = false;
    } else if (path.diffuse_vertices > 0 || bounce >= k_free_specular_bounces) {
        const std::optional<float> weight = roulette_weight(
            path.strength, bounce, [&] { return random.roulette(); }, settings_.roulette);
        path.goes_on = weight.has_value();
        // Before the first diffuse vertex both parts play; at it the indirect one alone.
        if (!path.goes_on && !(is_first_diffuse && direct_lives)) return false;
        if (weight) path.throughput *= *weight;
        if (path.diffuse_vertices == 0) path.direct_throughput = path.throughput;
    }
    path.origin = make_origin(vertex, *next);
    rays_[number] = spawn_ray(vertex.point, next->direction);
    return true;
}

void PathBatch::ask_lights(std::uint32_t path, bool direct, const Vertex& vertex,
                           const BounceSample& random) {
    for (int i = 0; i < light_count_; ++i)
        if (const auto light = unshadowed_light(scene_, settings_, vertex, random, i, light_count_))
            lights_.push_back(*light);
    requests_.push_back({path, direct, paths_[path].throughput, lights_.size()});
}

/// What the light samples of this bounce bring, where nothing stands between.
void PathBatch::collect_light(int bounce) {
    // What the camera sees lies side by side, and is mostly shaded by the same things; later vertices lie anywhere.
    const auto arrives = [&](const Ray& ray) {
        return !(bounce == 0 ? occluded(scene_, ray, occluders_) : occluded(scene_, ray));
    };
    std::size_t light = 0;
    for (const LightRequest& request : requests_) {
        Rgb sum;
        for (; light < request.end; ++light)
            if (arrives(lights_[light].ray)) sum += lights_[light].radiance;
        PartsRadiance& radiance = radiance_[request.path];
        (request.direct ? radiance.direct : radiance.indirect) += request.throughput * sum;
    }
}

}  // namespace pathscope
