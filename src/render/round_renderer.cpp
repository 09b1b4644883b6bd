#include "pathscope/render/round_renderer.hpp"

#include <algorithm>
#include <span>

#include "pathscope/core/parallel_for.hpp"
#include "pathscope/integrator/path_batch.hpp"

namespace pathscope {
namespace {

/// One row of a round; rows are put together in order, so that the lists do not depend on the threads.
struct RowResult {
    std::uint64_t rays = 0;
    std::uint64_t saturated = 0;
    std::vector<DroppedSample> dropped;
};

bool is_radiance(Rgb value) { return is_finite(value) && min_component(value) >= 0; }

/// What a row is rendered from.
struct RowTask {
    const Scene& scene;
    const CameraFrame& camera;
    const RenderSettings& settings;
    const Round& round;
    WorkCounter* work_done;
    int y;
};

/// Which sample of the row.
struct RowSample {
    int x;
    std::uint32_t number;
};

/// The sums and the account of one part of a row.
class RowSums {
  public:
    RowSums(const RowTask& task, RoundResult& result) : task_(task) {
        const std::size_t row = std::size_t(task.y - task.round.rect.y);
        sums_ = &result.sums[row * std::size_t(task.round.rect.width)];
    }

    void add(const RowSample& sample, Rgb radiance) {
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

/// Calls finish(sample, its radiance) for each sample of the row, pixel by pixel.
template <class Finish>
void trace_row(const RowTask& task, LightParts parts, std::uint64_t& rays, Finish finish) {
    const RenderSettings& settings = task.settings;
    const Round& round = task.round;
    PathBatch batch(task.scene, task.camera, settings.transport, parts);
    std::vector<RowSample> samples;
    const auto trace_batch = [&] {
        const std::span<const PartsRadiance> radiance = batch.trace(rays);
        for (std::size_t i = 0; i < samples.size(); ++i) finish(samples[i], radiance[i]);
        if (task.work_done) task.work_done->fetch_add(samples.size(), std::memory_order_relaxed);
        samples.clear();
    };
    for (int x = round.rect.x; x < round.rect.x + round.rect.width; ++x)
        for (std::uint32_t number = round.first; number < round.first + round.count; ++number) {
            samples.push_back({x, number});
            batch.add(x, task.y, PixelSampler(settings.transport.sampler, settings.seed, x, task.y, number));
            if (batch.full()) trace_batch();
        }
    if (!samples.empty()) trace_batch();
}

RowResult render_row(const RowTask& task, LightPart part, RoundResult& result) {
    RowSums sums(task, result);
    const bool direct = part == LightPart::direct;
    trace_row(task, {direct, !direct}, sums.rays(),
              [&](const RowSample& sample, const PartsRadiance& radiance) {
                  sums.add(sample, direct ? radiance.direct : radiance.indirect);
              });
    return sums.take();
}

struct PartsRow {
    RowResult direct, indirect;
};

PartsRow render_parts_row(const RowTask& task, PartsResult& result) {
    RowSums direct(task, result.direct), indirect(task, result.indirect);
    trace_row(task, {true, true}, indirect.rays(),
              [&](const RowSample& sample, const PartsRadiance& radiance) {
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
    const auto render = [&](const RowTask& task) { return render_row(task, part, result); };
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
