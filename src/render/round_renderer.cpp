#include "pathscope/render/round_renderer.hpp"

#include <algorithm>
#include <array>
#include <span>

#include "pathscope/core/parallel_for.hpp"

namespace pathscope {
namespace {

/// One row of a round; rows are put together in order, so that the lists do not depend on the threads.
struct RowResult {
    std::uint64_t rays = 0;
    std::uint64_t saturated = 0;
    std::vector<DroppedSample> dropped;
};

bool is_radiance(Rgb value) { return is_finite(value) && min_component(value) >= 0; }

/// Some samples of a row, pixel by pixel, whose camera rays are traced together: they are close to each other.
class CameraPacket {
  public:
    struct Sample {
        int x;
        std::uint32_t number;
        PixelSampler sampler;
    };

    [[nodiscard]] bool full() const { return samples_.size() == k_packet_rays; }
    void add(int x, std::uint32_t number, const PixelSampler& sampler, const Ray& ray) {
        samples_.push_back({x, number, sampler});
        rays_.push_back(ray);
    }

    /// Calls finish(sample, its ray and hit) for each; then the packet is empty.
    template <class Finish>
    void trace(const Scene& scene, Finish finish) {
        std::array<std::optional<SceneHit>, k_packet_rays> hits;
        intersect(scene, rays_, std::span(hits).first(rays_.size()));
        for (std::size_t i = 0; i < samples_.size(); ++i) finish(samples_[i], TracedRay{rays_[i], hits[i]});
        samples_.clear();
        rays_.clear();
    }

  private:
    std::vector<Sample> samples_;
    std::vector<Ray> rays_;
};

template <LightPart part>
RowResult render_row(const Scene& scene, const CameraFrame& camera, const RenderSettings& settings,
                     const Round& round, int y, PixelSum* sums) {
    RowResult row;
    const auto finish = [&](const CameraPacket::Sample& sample, const TracedRay& first) {
        ++row.rays;
        const Rgb radiance =
            estimate_radiance<part>(scene, settings.transport, first, sample.sampler, row.rays);
        if (!is_radiance(radiance)) {
            row.dropped.push_back({std::uint32_t(sample.x), std::uint32_t(y), sample.number});
            return;
        }
        bool saturated = false;
        sums[sample.x - round.rect.x] += quantise(radiance, settings.quantum, saturated);
        row.saturated += saturated;
    };

    CameraPacket packet;
    for (int x = round.rect.x; x < round.rect.x + round.rect.width; ++x)
        for (std::uint32_t sample = round.first; sample < round.first + round.count; ++sample) {
            const PixelSampler sampler(settings.transport.sampler, settings.seed, x, y, sample);
            packet.add(x, sample, sampler, camera_ray(camera, x, y, sampler.get_2d(k_pixel_dimension)));
            if (packet.full()) packet.trace(scene, finish);
        }
    packet.trace(scene, finish);
    return row;
}

void append(RoundResult& result, const RowResult& row) {
    result.rays += row.rays;
    result.saturated_count += row.saturated;
    result.dropped_count += row.dropped.size();
    const std::size_t room = k_max_dropped_listed - result.dropped.size();
    const auto end = row.dropped.begin() + std::ptrdiff_t(std::min(room, row.dropped.size()));
    result.dropped.insert(result.dropped.end(), row.dropped.begin(), end);
}

}  // namespace

std::optional<RoundResult> render_round(const Scene& scene, const Camera& camera,
                                        const RenderSettings& settings, LightPart part, const Round& round,
                                        int threads, const CancelFlag* cancelled) {
    const PixelRect frame{0, 0, settings.width, settings.height};
    CHECK(frame.contains(round.rect), round.rect, settings.width, settings.height);

    const CameraFrame camera_frame = make_camera(camera, settings.width, settings.height);
    RoundResult result;
    result.sums.resize(std::size_t(round.rect.area()));
    std::vector<RowResult> rows(std::size_t(round.rect.height));
    const auto stopped = [&] { return cancelled && cancelled->load(std::memory_order_relaxed); };

    parallel_for(round.rect.height, threads, [&](int row) {
        if (stopped()) return;
        PixelSum* sums = &result.sums[std::size_t(row) * std::size_t(round.rect.width)];
        const int y = round.rect.y + row;
        rows[std::size_t(row)] =
            part == LightPart::direct
                ? render_row<LightPart::direct>(scene, camera_frame, settings, round, y, sums)
                : render_row<LightPart::indirect>(scene, camera_frame, settings, round, y, sums);
    });
    if (stopped()) return std::nullopt;
    for (const RowResult& row : rows) append(result, row);
    result.samples = round.samples();
    return result;
}

}  // namespace pathscope
