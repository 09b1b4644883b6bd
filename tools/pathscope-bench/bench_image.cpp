/// image: how many samples a second does a whole picture take, and how far is it from the truth after how many seconds?
///
/// The truth is a picture of many samples with the best setting and a seed that no run uses; its own noise adds
/// sqrt(1 + spp / reference_spp) to what it measures. Each round renders with a seed of its own, all settings and numbers
/// of samples in turn. Samples per second alone mislead: a setting may be quick and noisy, which is why the error
/// stands beside the seconds.

#include <fmt/format.h>

#include <tuple>

#include "bench.hpp"
#include "measure.hpp"
#include "pathscope/image/metrics.hpp"
#include "pathscope/render/rendered_frame.hpp"
#include "pictures.hpp"
#include "scene_list.hpp"
#include "terminal.hpp"

namespace pathscope::bench {
namespace {

using Json = nlohmann::ordered_json;

struct Task {
    const Scene& scene;
    Camera camera;
    RenderSettings settings;
    int threads;
};

/// One rendering, and what it took.
struct Rendering {
    Image image;
    Cost cost;
    double samples = 0, rays = 0;
};

Rendering render(const Task& task) {
    Rendering result;
    LocalRender local{};
    result.cost = cost_of(
        [&] { local = render_locally(task.scene, task.camera, task.settings, k_block_size, task.threads); });
    result.samples = double(local.samples);
    result.rays = double(local.rays);
    result.image = compose_frame(local.direct, local.indirect, task.settings, {}, task.threads).combined;
    return result;
}

/// One setting at one number of samples, over the rounds.
struct Series {
    Setting setting = Setting::best;
    std::uint32_t spp = 1;
    std::vector<Cost> costs;
    std::vector<double> rmse;
    double samples = 0, rays = 0;  ///< Of the last round.
};

/// 1, 2, 4, ... and the most itself.
std::vector<std::uint32_t> sample_counts(std::uint32_t most) {
    std::vector<std::uint32_t> counts;
    for (std::uint32_t spp = 1; spp < most; spp *= 2) counts.push_back(spp);
    counts.push_back(most);
    return counts;
}

void set_samples(RenderSettings& settings, std::uint32_t spp) { settings.spp = settings.direct_spp = spp; }

/// Round 0 warms up, and is not kept.
void render_round(Series& series, Task task, std::uint32_t round, int max_bounces, const Image& truth) {
    task.settings.transport = make_settings(series.setting);
    task.settings.transport.max_bounces = max_bounces;
    task.settings.seed = 1 + round;
    set_samples(task.settings, series.spp);
    const Rendering done = render(task);
    if (round == 0) return;
    series.costs.push_back(done.cost);
    series.rmse.push_back(rmse(done.image, truth));
    series.samples = done.samples;
    series.rays = done.rays;
}

/// The row of a setting, from its series in rising order of samples.
Json make_row(const std::string& scene, const Task& task, const std::vector<const Series*>& of_setting) {
    const Series& most = *of_setting.back();
    const Cost cost = median(most.costs);
    Json curve = Json::array();
    for (const Series* series : of_setting)
        curve.push_back({{"spp", series->spp},
                         {"s", median(series->costs).wall_s},
                         {"cpu_s", median(series->costs).cpu_s},
                         {"rmse", median(series->rmse)}});
    return {{"scene", scene},
            {"setting", std::string(name_of(most.setting))},
            {"width", task.settings.width},
            {"height", task.settings.height},
            {"threads", task.threads},
            {"spp", most.spp},
            {"samples_per_s", most.samples / cost.wall_s},
            {"rays_per_s", most.rays / cost.wall_s},
            {"samples_per_cpu_s", most.samples / cost.cpu_s},
            {"rmse_at_s", curve}};
}

/// The rows of one scene at one number of threads, textbook and best.
Json bench_threads(const std::string& name, const Task& task, int max_bounces, const Image& truth,
                   const BenchOptions& options) {
    std::vector<Series> all;
    for (const auto& setting : k_setting_names)
        for (const std::uint32_t spp : sample_counts(std::uint32_t(options.spp.value_or(16))))
            all.push_back({setting.value, spp, {}, {}, 0, 0});
    for (int round = 0; round <= options.runs; ++round) {
        show_progress(fmt::format("{}: round {} of {}, {} threads", name, round, options.runs, task.threads));
        for (Series& series : all) render_round(series, task, std::uint32_t(round), max_bounces, truth);
    }
    Json rows = Json::array();
    for (const auto& setting : k_setting_names) {
        std::vector<const Series*> of_setting;
        for (const Series& series : all)
            if (series.setting == setting.value) of_setting.push_back(&series);
        rows.push_back(make_row(name, task, of_setting));
    }
    return rows;
}

Result<Json> bench_scene(const SceneChoice& choice, const BenchOptions& options) {
    show_progress(fmt::format("{}: load", choice.name));
    Result<OpenedScene> opened = open_scene(choice.path, {});
    if (!opened) return opened.error();
    const Result<Scene> scene = make_scene(opened->file, std::move(opened->parts));
    if (!scene) return scene.error();

    Task task{*scene, opened->file.cameras.front().view, {}, 0};
    std::tie(task.settings.width, task.settings.height) = options.size.value_or(std::pair(256, 144));
    task.settings.quantum = quantum_for(scene->typical_radiance, scene->brightest_radiance);
    const int max_bounces = opened->file.defaults.bounces.value_or(0);
    task.settings.transport.max_bounces = max_bounces;

    show_progress(fmt::format("{}: reference", choice.name));
    Task reference = task;
    reference.settings.seed = k_reference_seed;
    set_samples(reference.settings, std::uint32_t(options.reference_spp.value_or(256)));
    const Image truth = render(reference).image;

    Json rows = Json::array();
    for (const int threads : options.threads.empty() ? std::vector{1} : options.threads) {
        task.threads = threads;
        for (Json& row : bench_threads(choice.name, task, max_bounces, truth, options))
            rows.push_back(std::move(row));
    }
    return rows;
}

void print_table(const Json& rows) {
    TextTable table(
        {"scene", "setting", "threads", "spp", "ksamples/s", "krays/s", "s", "RMSE", "MSE x CPU s"});
    for (const Json& row : rows) {
        const Json& last = row["rmse_at_s"].back();
        const double error = last["rmse"];
        table.add({row["scene"], row["setting"], std::to_string(row["threads"].get<int>()),
                   std::to_string(row["spp"].get<int>()),
                   fmt::format("{:.0f}", row["samples_per_s"].get<double>() * 1e-3),
                   fmt::format("{:.0f}", row["rays_per_s"].get<double>() * 1e-3),
                   fmt::format("{:.3f}", last["s"].get<double>()), fmt::format("{:.4g}", error),
                   fmt::format("{:.4g}", error * error * last["cpu_s"].get<double>())});
    }
    table.print();
}

}  // namespace

Result<Report> bench_image(const BenchOptions& options) {
    const Result<std::vector<SceneChoice>> scenes = list_scenes(options);
    if (!scenes) return scenes.error();
    Report report;
    report.extra["reference_spp"] = options.reference_spp.value_or(256);
    for (const SceneChoice& scene : *scenes) {
        Result<Json> rows = bench_scene(scene, options);
        if (!rows) return rows.error();
        for (Json& row : *rows) report.rows.push_back(std::move(row));
    }
    show_progress("");
    print_table(report.rows);
    return report;
}

}  // namespace pathscope::bench
