#include "pathscope/render/round_renderer.hpp"

#include <algorithm>
#include <array>
#include <span>

#include "pathscope/core/parallel_for.hpp"
#include "pathscope/integrator/both_parts.hpp"

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
    void trace(const Scene& scene, WorkCounter* work_done, Finish finish) {
        std::array<std::optional<SceneHit>, k_packet_rays> hits;
        intersect(scene, rays_, std::span(hits).first(rays_.size()));
        for (std::size_t i = 0; i < samples_.size(); ++i) finish(samples_[i], TracedRay{rays_[i], hits[i]});
        if (work_done) work_done->fetch_add(samples_.size(), std::memory_order_relaxed);
        samples_.clear();
        rays_.clear();
    }

  private:
    std::vector<Sample> samples_;
    std::vector<Ray> rays_;
};

/// What a row is rendered from.
struct RowTask {
    const Scene& scene;
    const CameraFrame& camera;
    const RenderSettings& settings;
    const Round& round;
    WorkCounter* work_done;
    int y;
};

/// The sums and the account of one part of a row.
class RowSums {
  public:
    RowSums(const RowTask& task, RoundResult& result) : task_(task) {
        const std::size_t row = std::size_t(task.y - task.round.rect.y);
        sums_ = &result.sums[row * std::size_t(task.round.rect.width)];
    }

    void add(const CameraPacket::Sample& sample, Rgb radiance) {
        if (!is_radiance(radiance)) {
            row_.dropped.push_back({std::uint32_t(sample.x), std::uint32_t(task_.y), sample.number});
            return;
        }
        bool saturated = false;
        sums_[sample.x - task_.round.rect.x] += quantise(radiance, task_.settings.quantum, saturated);
        row_.saturated += saturated;
    }

    [[nodiscard]] std::uint64_t& rays() { return row_.rays; }
    [[nodiscard]] RowResult take() { return std::move(row_); }

  private:
    const RowTask& task_;
    PixelSum* sums_;
    RowResult row_;
};

/// Calls finish(sample, its camera ray and hit) for each sample of the row.
template <class Finish>
void each_sample(const RowTask& task, Finish finish) {
    const auto& [scene, camera, settings, round, work_done, y] = task;
    CameraPacket packet;
    for (int x = round.rect.x; x < round.rect.x + round.rect.width; ++x)
        for (std::uint32_t sample = round.first; sample < round.first + round.count; ++sample) {
            const PixelSampler sampler(settings.transport.sampler, settings.seed, x, y, sample);
            packet.add(x, sample, sampler, camera_ray(camera, x, y, sampler.get_2d(k_pixel_dimension)));
            if (packet.full()) packet.trace(scene, work_done, finish);
        }
    packet.trace(scene, work_done, finish);
}

template <LightPart part>
RowResult render_row(const RowTask& task, RoundResult& result) {
    RowSums sums(task, result);
    each_sample(task, [&](const CameraPacket::Sample& sample, const TracedRay& first) {
        ++sums.rays();
        sums.add(sample, estimate_radiance<part>(task.scene, task.settings.transport, first, sample.sampler,
                                                 sums.rays()));
    });
    return sums.take();
}

struct PartsRow {
    RowResult direct, indirect;
};

PartsRow render_parts_row(const RowTask& task, PartsResult& result) {
    RowSums direct(task, result.direct), indirect(task, result.indirect);
    each_sample(task, [&](const CameraPacket::Sample& sample, const TracedRay& first) {
        ++indirect.rays();
        const PartsRadiance radiance =
            estimate_both_parts(task.scene, task.settings.transport, first, sample.sampler, indirect.rays());
        direct.add(sample, radiance.direct);
        indirect.add(sample, radiance.indirect);
    });
    return {direct.take(), indirect.take()};
}

void append(RoundResult& result, const RowResult& row) {
    result.rays += row.rays;
    result.saturated_count += row.saturated;
    result.dropped_count += row.dropped.size();
    const std::size_t room = k_max_dropped_listed - result.dropped.size();
    const auto end = row.dropped.begin() + std::ptrdiff_t(std::min(room, row.dropped.size()));
    result.dropped.insert(result.dropped.end(), row.dropped.begin(), end);
}

RoundResult empty_result(const Round& round) {
    RoundResult result;
    result.sums.resize(std::size_t(round.rect.area()));
    result.samples = round.samples();
    return result;
}

/// rows[i] = render(row i), on `threads` threads; false if `cancelled` became true.
template <class Row, class Render>
bool render_rows(const Scene& scene, const Camera& camera, const RenderSettings& settings, const Round& round,
                 int threads, const CancelFlag* cancelled, WorkCounter* work_done, std::vector<Row>& rows,
                 Render render) {
    const PixelRect frame{0, 0, settings.width, settings.height};
    CHECK(frame.contains(round.rect), round.rect, settings.width, settings.height);
    const CameraFrame camera_frame = make_camera(camera, settings.width, settings.height);
    const auto stopped = [&] { return cancelled && cancelled->load(std::memory_order_relaxed); };
    rows.resize(std::size_t(round.rect.height));
    parallel_for(round.rect.height, threads, [&](int row) {
        if (!stopped())
            rows[std::size_t(row)] =
                render(RowTask{scene, camera_frame, settings, round, work_done, round.rect.y + row});
    });
    return !stopped();
}

}  // namespace

std::optional<RoundResult> render_round(const Scene& scene, const Camera& camera,
                                        const RenderSettings& settings, LightPart part, const Round& round,
                                        int threads, const CancelFlag* cancelled, WorkCounter* work_done) {
    RoundResult result = empty_result(round);
    std::vector<RowResult> rows;
    const auto render = [&](const RowTask& task) {
        return part == LightPart::direct ? render_row<LightPart::direct>(task, result)
                                         : render_row<LightPart::indirect>(task, result);
    };
    if (!render_rows(scene, camera, settings, round, threads, cancelled, work_done, rows, render))
        return std::nullopt;
    for (const RowResult& row : rows) append(result, row);
    return result;
}

std::optional<PartsResult> render_both_parts(const Scene& scene, const Camera& camera,
                                             const RenderSettings& settings, const Round& round, int threads,
                                             const CancelFlag* cancelled, WorkCounter* work_done) {
    PartsResult result{empty_result(round), empty_result(round)};
    std::vector<PartsRow> rows;
    const auto render = [&](const RowTask& task) { return render_parts_row(task, result); };
    if (!render_rows(scene, camera, settings, round, threads, cancelled, work_done, rows, render))
        return std::nullopt;
    for (const PartsRow& row : rows) {
        append(result.direct, row.direct);
        append(result.indirect, row.indirect);
    }
    return result;
}

}  // namespace pathscope
